"""Completions of moves with their status, and stuck axes, whose moves never end."""

from __future__ import annotations

import pytest
from motor_host import told, under_way

from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND


@pytest.mark.parametrize(
    ("name", "completed", "stopped", "bits"),
    [
        ("TDC001", m.MotMoveCompletedDc, m.MotMoveStoppedDc, 0x8000_3000),
        ("BBD202", m.MotMoveCompletedDc, m.MotMoveStoppedDc, 0x8000_3000),
        ("BSC102", m.MotMoveCompletedStepper, m.MotMoveStoppedStepper, 0x1100),
        ("TST001", m.MotMoveCompletedStepper, m.MotMoveStoppedStepper, 0x1100),
    ],
)
def test_a_completion_has_the_status_of_its_instant(
    name: str, completed: type, stopped: type, bits: int
) -> None:
    host = told(name)
    host.say(m.MotMoveRelative(1, 25_000))
    host.wait(10)
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(1)
    host.say(m.MotMoveStop(1, 1))
    (_, first), (_, second) = host.said
    assert type(first) is completed
    assert (first.position, first.status_bits) == (25_000, bits)
    assert type(second) is stopped
    assert (second.position, second.status_bits) == (17_500, bits)


@pytest.mark.parametrize("advance", [0.000_000_001, 0.001, 0.37, 100])
def test_the_instant_of_a_completion_does_not_depend_on_the_steps_of_time(advance: float) -> None:
    """1,000 counts take 2 √(1000/20000) s."""
    host = told("TDC001")
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(0.4472135)
    for _ in range(100):
        host.wait(advance)
        if host.said:
            break
    [(when, _)] = host.said
    assert when == 447_213_595
    assert host.kinds == ["MOT_MOVE_COMPLETED"]


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
def test_a_stuck_axis_reports_motion_but_does_not_move(name: str) -> None:
    host = told(name)
    host.stick(True)
    host.say(m.MotMoveRelative(1, 25_000))
    for _ in range(100):
        host.wait(0.1)
        assert host.position == 0
        assert "moving_forward" in host.bits
        assert "settled" not in host.bits
        assert ("tracking" in host.bits) is False
    assert host.said == []


def test_an_axis_that_gets_stuck_stops() -> None:
    host = under_way("BSC001")
    host.stick(True)
    host.wait(60)
    assert (host.position, host.said) == (7_500, [])
    assert "moving_forward" in host.bits


@pytest.mark.parametrize(("name", "limit"), [("TDC001", 65_535), ("BBD101", 20_000)])
def test_an_excessive_position_error_stops_a_servo(name: str, limit: int) -> None:
    """Page 62: the bit is set and the axis stops. It covers 2,500 counts in 0.5 s, then 10,000 counts/s."""
    host = told(name)
    if name == "BBD101":
        loop = m.MotSetPmdPositionLoopParams(1, 65, 175, 80_000, 600, 5, 3277, 0, 1000, limit)
        host.say(loop)
    host.stick(True)
    host.say(m.MotMoveVelocity(1, 2))
    seconds = 0.5 + (limit - 2_500) / 10_000
    host.wait(seconds - 0.001)
    assert "motion_error" not in host.bits
    host.wait(0.002)
    assert host.bits >= {"motion_error"}
    assert "moving_reverse" not in host.bits
    assert host.row.state == "motion error"
    host.wait(60)
    assert (host.position, host.said) == (0, [])
    host.stick(False)
    host.say(m.MotMoveRelative(1, 1_000))
    assert "motion_error" not in host.bits
    host.wait(5)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]


def test_enabling_clears_a_motion_error() -> None:
    host = told("TDC001")
    host.stick(True)
    host.say(m.MotMoveRelative(1, 200_000))
    host.wait(60)
    assert "motion_error" in host.bits
    host.say(m.ModSetChanEnableState(1, 2))
    host.say(m.ModSetChanEnableState(1, 1))
    assert "motion_error" not in host.bits


def test_a_stepper_never_detects_that_it_is_stuck() -> None:
    host = told("BSC001")
    host.stick(True)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(1000)
    assert (host.position, host.said) == (0, [])
    assert "moving_forward" in host.bits


@pytest.mark.parametrize("mode", [1, 2])
def test_a_stuck_axis_can_be_stopped(mode: int) -> None:
    host = told("TDC001")
    host.stick(True)
    host.say(m.MotMoveRelative(1, 25_000))
    host.wait(1)
    assert isinstance(host.ask(m.MotMoveStop(1, mode)), m.MotMoveStoppedDc)
    host.wait(60)
    assert host.said == []


def test_getting_stuck_during_a_stop_completes_the_stop() -> None:
    host = under_way("TDC001")
    host.say(m.MotMoveStop(1, 2))
    host.wait(0.25)
    host.stick(True)
    assert [(when, message.position) for when, message in host.said] == [(SECOND * 5 // 4, 9_375)]


def test_a_released_axis_continues_to_its_target() -> None:
    host = under_way("TDC001")
    host.stick(True)
    host.wait(2)
    host.stick(False)
    host.wait(60)
    [(when, message)] = host.said
    assert message.position == 25_000
    assert when == (3 + 0.5 + 1.75) * SECOND  # 17,500 counts from rest


def test_a_power_cycle_does_not_release_an_axis() -> None:
    host = told("BSC001")
    host.stick(True)
    host.instrument.power_cycle()
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(60)
    assert (host.position, host.said) == (0, [])


def test_a_suspended_completion_is_not_sent() -> None:
    host = told("TDC001")
    host.say(m.MotSuspendEndOfMoveMsgs())
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(5)
    assert (host.position, host.said) == (1_000, [])
    host.say(m.MotResumeEndOfMoveMsgs())
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(5)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]

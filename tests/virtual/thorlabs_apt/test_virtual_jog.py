"""Jogs: single steps and continuous motion, with their own parameters."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND

CONTINUOUS, STEP = 1, 2
IMMEDIATE, PROFILED = 1, 2


def jogging(name: str, mode: int, stop: int = PROFILED) -> MotorHost:
    """Return a motor with jogs of 25,000 counts, 10,000 counts/s and 20,000 counts/s²; moves are faster."""
    host = MotorHost(name, travel=1_000_000, position=500_000)
    host.say(m.MotSetVelParams(1, 0, 2_000_000, 100_000))
    host.say(m.MotSetJogParams(1, mode, 25_000, 0, 20_000, 10_000, stop))
    return host


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
@pytest.mark.parametrize(("direction", "position"), [(1, 25_000), (2, -25_000)])
def test_a_step_has_its_own_velocity(name: str, direction: int, position: int) -> None:
    host = jogging(name, STEP)
    host.say(m.MotMoveJog(1, direction))
    host.wait(1)
    assert abs(host.velocity) == 10_000
    host.wait(5)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_COMPLETED"
    assert (when, message.position) == (3 * SECOND, position)


def test_a_step_in_motion_starts_at_the_present_position() -> None:
    host = jogging("TDC001", STEP)
    host.say(m.MotMoveJog(1, 1))
    host.wait(1)
    host.say(m.MotMoveJog(1, 1))
    host.wait(10)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == 7_500 + 25_000


@pytest.mark.parametrize(("direction", "sign"), [(1, 1), (2, -1)])
def test_a_continuous_jog_continues_to_the_limit(direction: int, sign: int) -> None:
    host = jogging("BSC001", CONTINUOUS)
    host.say(m.MotMoveJog(1, direction))
    host.wait(20.25)
    assert host.said == []
    assert host.position == sign * 200_000
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == sign * 500_000


def test_the_other_direction_reverses_a_jog() -> None:
    host = jogging("TDC001", CONTINUOUS)
    host.say(m.MotMoveJog(1, 1))
    host.wait(1)
    host.say(m.MotMoveJog(1, 2))
    host.wait(2)
    assert host.velocity == -10_000
    assert host.said == []


@pytest.mark.parametrize(
    ("own", "asked", "after"),
    [
        (PROFILED, IMMEDIATE, 0),
        (IMMEDIATE, PROFILED, 0.5),
        (IMMEDIATE, 0, 0),  # a stop without a mode uses that of the jog parameters
        (PROFILED, 0, 0.5),
    ],
)
def test_a_stop_without_a_mode_uses_that_of_the_jog(own: int, asked: int, after: float) -> None:
    host = jogging("TDC001", CONTINUOUS, own)
    host.say(m.MotMoveJog(1, 1))
    host.wait(1)
    host.say(m.MotMoveStop(1, asked))
    host.wait(5)
    [(when, message)] = host.said
    assert isinstance(message, m.MotMoveStoppedDc)
    assert when == (1 + after) * SECOND
    assert message.position == 7_500 + 5_000 * after


def test_any_other_motion_without_a_mode_stops_with_a_profile() -> None:
    host = jogging("TDC001", CONTINUOUS, IMMEDIATE)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(1)
    host.say(m.MotMoveStop(1, 0))
    host.wait(5)
    assert [when for when, _ in host.said] == [1.05 * SECOND]

"""Homing: the destination, the duration, and the counters afterwards."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.clock import SECOND

FORWARD, REVERSE = (1, 4), (2, 1)  # direction and switch, with the values of public drivers


def homing(name: str, *home: int, position: int = 20_000) -> MotorHost:
    """Return a motor that homes, with an acceleration of 20,000 counts/s²."""
    host = MotorHost(name, travel=100_000, position=position)
    host.say(m.MotSetVelParams(1, 0, 20_000, 50_000))
    host.say(m.MotSetHomeParams(1, *home))
    host.say(m.MotMoveHome(1))
    return host


@pytest.mark.parametrize("name", ["TDC001", "ODC001", "TST001", "BSC001", "BSC103", "MST601"])
@pytest.mark.parametrize(
    ("home", "way", "lowest", "highest"),
    [(REVERSE, 20_000, 0, 100_000), (FORWARD, 80_000, -100_000, 0)],
)
def test_homing_sets_the_position_to_zero_at_the_switch(
    name: str, home: tuple[int, int], way: int, lowest: int, highest: int
) -> None:
    """It accelerates for 0.5 s over 2,500 counts, and reaches the switch at 10,000 counts/s."""
    host = homing(name, *home, 10_000, 0)
    host.wait(60)
    [(when, message)] = host.said
    assert message == m.MotMoveHomed(1)
    assert when == pytest.approx((0.5 + (way - 2_500) / 10_000) * SECOND, abs=SECOND // 10_000)
    assert host.position == 0
    assert "homed" in host.bits
    for end in (lowest, highest):
        host.say(m.MotMoveAbsolute(1, end * 2))
        host.wait(60)
        assert host.position == end


@pytest.mark.parametrize(("home", "end"), [(REVERSE, -3_000), (FORWARD, 3_000)])
def test_homing_moves_back_from_the_switch_by_the_offset(home: tuple[int, int], end: int) -> None:
    host = homing("TDC001", *home, 10_000, 3_000)
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED"]
    assert host.position == 0
    assert not host.bits & {"reverse_hardware_limit", "forward_hardware_limit"}
    host.say(m.MotMoveAbsolute(1, 40 * end))
    host.wait(60)
    assert host.position == end


def test_homing_also_sets_the_encoder_counter_to_zero() -> None:
    host = homing("BSC001", *REVERSE, 10_000, 0)
    host.say(m.MotSetEncCounter(1, 5))
    host.wait(60)
    assert host.ask(m.MotReqEncCounter(1)).encoder_count == 0


@pytest.mark.parametrize("home", [(0, 0), (1, 1), (2, 4), (2, 0)])
def test_homing_without_a_switch_runs_into_the_end(home: tuple[int, int]) -> None:
    """Home parameters that are all zero have driven real stages into their ends."""
    host = homing("TDC001", *home, 10_000, 0)
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_STOPPED"]
    assert "homed" not in host.bits
    assert host.position == (80_000 if home[0] == 1 else -20_000)


@pytest.mark.parametrize(("home", "found"), [(REVERSE, False), (FORWARD, True)])
def test_homing_does_not_find_an_ignored_switch(home: tuple[int, int], found: bool) -> None:
    """Page 39: "Ignore switch or switch not present", here for the reverse switch."""
    host = MotorHost("TDC001", travel=100_000, position=50_000)
    host.say(m.MotSetLimSwitchParams(1, 2, 1, 0, 0, 1))
    host.say(m.MotSetHomeParams(1, *home, 50_000, 0))
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED" if found else "MOT_MOVE_STOPPED"]
    assert ("homed" in host.bits) is found


@pytest.mark.parametrize(
    ("clockwise", "counterclockwise", "found"),
    [(2, 2, True), (4, 1, True), (1, 4, True), (1, 1, False)],
)
def test_a_stage_without_ends_has_one_switch_for_both_settings(
    clockwise: int, counterclockwise: int, found: bool
) -> None:
    """A public driver homes the K10CR1 with 4 and 1: only at home, and ignored."""
    host = MotorHost("K10CR1")
    host.say(m.MotSetLimSwitchParams(1, clockwise, counterclockwise, 0, 0, 1))
    host.say(m.MotSetHomeParams(1, *REVERSE, 73_300_775, 546_133))
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.kinds == (["MOT_MOVE_HOMED"] if found else [])
    assert ("homed" in host.bits) is found


@pytest.mark.parametrize("name", ["BBD101", "BBD102", "BBD203"])
@pytest.mark.parametrize("home", [(0, 0), FORWARD, REVERSE, (77, 99)])
def test_a_brushless_stage_uses_only_the_home_velocity(name: str, home: tuple[int, int]) -> None:
    """Page 37: the direction is always positive, and neither a switch nor the offset is used."""
    host = homing(name, *home, 10_000, 12_345)
    host.wait(1)
    assert host.velocity == -10_000
    host.wait(1.8)
    assert host.velocity > 0  # the last approach is positive
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED"]
    assert host.position == 0
    for asked, reached in ((500_000, 100_000), (-500_000, 0)):
        host.say(m.MotMoveAbsolute(1, asked))
        host.wait(60)
        assert host.position == reached


def test_homing_again_clears_the_homed_state() -> None:
    host = homing("TDC001", *REVERSE, 10_000, 0)
    host.wait(60)
    host.say(m.MotMoveAbsolute(1, 50_000))
    host.wait(60)
    host.say(m.MotMoveHome(1))
    assert "homed" not in host.bits
    assert "homing" in host.bits
    host.wait(1)
    host.say(m.MotMoveStop(1, 1))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED", "MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED"]
    assert not host.bits & {"homing", "homed"}


def test_a_move_takes_over_from_homing() -> None:
    host = homing("TDC001", *REVERSE, 10_000, 0)
    host.wait(1)
    host.say(m.MotMoveAbsolute(1, 0))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == 0
    assert "homed" not in host.bits


def test_homing_ignores_soft_limits() -> None:
    host = MotorHost("TDC001", travel=100_000, position=20_000)
    host.say(m.MotSetLimSwitchParams(1, 2, 2, 1_000, -1_000, 2))
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED"]


@pytest.mark.parametrize(
    ("name", "stage"),
    [("TDC001", stages.Z8), ("BBD102", stages.MLS203), ("BSC101", stages.APT_STEPPER)],
)
def test_a_new_controller_homes_within_seconds(name: str, stage: object) -> None:
    host = MotorHost(name, stage=stage)
    host.say(m.MotMoveHome(1))
    host.wait(60)
    [(when, message)] = host.said
    assert message == m.MotMoveHomed(1)
    assert SECOND < when < 20 * SECOND


def test_a_stage_at_home_homes_again() -> None:
    host = homing("TDC001", *REVERSE, 10_000, 0, position=0)
    host.wait(1)
    assert host.kinds == ["MOT_MOVE_HOMED"]

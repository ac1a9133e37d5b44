"""Backlash correction: the last approach is always from the same side (page 34)."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND


def slack(name: str, distance: int, *, position: int = 500_000) -> MotorHost:
    host = MotorHost(name, travel=1_000_000, position=position)
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(m.MotSetGenMoveParams(1, distance))
    return host


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
@pytest.mark.parametrize(
    ("distance", "target", "turn"),
    [
        (5_000, -25_000, -30_000),  # in reverse: overshoots, then forward to the target
        (-5_000, 25_000, 30_000),  # forward: overshoots and returns
        (5_000, 25_000, None),  # forward already
        (-5_000, -25_000, None),
        (0, -25_000, None),
    ],
)
@pytest.mark.parametrize("relative", [False, True])
def test_the_sign_of_the_backlash_determines_the_last_approach(
    name: str, distance: int, target: int, turn: int | None, relative: bool
) -> None:
    """25,000 counts take 3 s. 30,000 counts take 3.5 s, and 5,000 back take 1 s."""
    host = slack(name, distance)
    host.say(m.MotMoveRelative(1, target) if relative else m.MotMoveAbsolute(1, target))
    if turn is not None:
        host.wait(3.5)
        assert host.position == turn
    host.wait(10)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_COMPLETED"
    assert message.position == target
    assert when == (3 if turn is None else 4.5) * SECOND


def test_a_move_to_the_present_position_does_not_overshoot() -> None:
    assert isinstance(slack("TDC001", 5_000).ask(m.MotMoveAbsolute(1, 0)), m.MotMoveCompletedDc)


def test_an_overshoot_stops_at_the_end_of_the_travel() -> None:
    host = slack("TDC001", 5_000, position=25_000)
    host.say(m.MotMoveRelative(1, -24_000))
    host.wait(20)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == -24_000


@pytest.mark.parametrize("profiled", [False, True])
def test_an_overshoot_stops_at_a_soft_limit(profiled: bool) -> None:
    host = slack("TDC001", 5_000)
    host.say(m.MotSetLimSwitchParams(1, 2, 2, 100_000, -27_000, 3 if profiled else 2))
    host.say(m.MotMoveAbsolute(1, -25_000))
    host.wait(20)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == -25_000


@pytest.mark.parametrize(("distance", "turns"), [(5_000, True), (-5_000, False)])
def test_a_motor_that_cannot_stop_in_time_still_approaches_correctly(
    distance: int, turns: bool
) -> None:
    """At 7,500 counts and 10,000 counts/s it would come to rest at 10,000, beyond its new target."""
    host = slack("TDC001", distance)
    host.say(m.MotMoveAbsolute(1, 25_000))
    host.wait(1)
    host.say(m.MotMoveAbsolute(1, 8_000))
    lowest = 10_000
    for _ in range(300):
        host.wait(0.01)
        if host.velocity >= 0 and host.now > 1.6 * SECOND:
            lowest = min(lowest, host.position)
    assert lowest == (3_000 if turns else 8_000)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == 8_000


def test_jogs_have_no_backlash_correction() -> None:
    host = slack("TDC001", 5_000)
    host.say(m.MotSetJogParams(1, 2, 25_000, 0, 20_000, 10_000, 2))
    host.say(m.MotMoveJog(1, 2))
    host.wait(10)
    assert [when for when, _ in host.said] == [3 * SECOND]


def test_a_stop_during_the_overshoot_ends_the_move() -> None:
    host = slack("TDC001", 5_000)
    host.say(m.MotMoveAbsolute(1, -25_000))
    host.wait(1)
    host.say(m.MotMoveStop(1, 2))
    host.wait(10)
    assert host.kinds == ["MOT_MOVE_STOPPED"]
    assert host.position == -10_000

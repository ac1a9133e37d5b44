"""Stages without ends: positions count on after a turn, and the home switch is passed once a turn."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.clock import SECOND

TURN = 360
REVERSE, FORWARD = (2, 1), (1, 4)  # direction and switch, with the values of public drivers


def counts(degrees: float, quantity: str = "position") -> int:
    return stages.K10CR1.scale(quantity, "K10CR1").to_counts(degrees)


def rotation(degrees: float, **options: object) -> MotorHost:
    """Return a K10CR1 that begins at an angle after its home switch."""
    return MotorHost("K10CR1", position=counts(degrees), **options)


def home(host: MotorHost, direction: int, switch: int, offset: int = 0) -> None:
    before = host.ask(m.MotReqHomeParams(1))
    host.say(m.MotSetHomeParams(1, direction, switch, before.home_velocity, offset))
    host.say(m.MotMoveHome(1))
    host.wait(120)


def test_a_move_passes_a_whole_turn_in_both_directions() -> None:
    host = rotation(350)
    for degrees in (370, -20, 1080):
        host.say(m.MotMoveAbsolute(1, counts(degrees)))
        host.wait(120)
        assert host.position == counts(degrees)
        assert not host.bits & {"forward_hardware_limit", "reverse_hardware_limit"}


@pytest.mark.parametrize(
    ("home_parameters", "way"), [(REVERSE, 200), (FORWARD, 160)], ids=["reverse", "forward"]
)
def test_homing_ends_at_the_next_switch_of_the_direction(
    home_parameters: tuple[int, int], way: float
) -> None:
    """At 10 degrees per second and 20 degrees per second squared, half a second is lost."""
    host = rotation(200)
    host.say(m.MotSetVelParams(1, 0, counts(20, "acceleration"), counts(10, "velocity")))
    host.say(m.MotSetHomeParams(1, *home_parameters, counts(10, "velocity"), 0))
    host.say(m.MotMoveHome(1))
    host.wait(120)
    [(when, message)] = host.said
    assert message == m.MotMoveHomed(1)
    assert when / SECOND == pytest.approx(way / 10 + 0.5, abs=0.01)
    assert host.position == 0
    assert "homed" in host.bits


def test_homing_returns_by_the_offset() -> None:
    host = rotation(90)
    home(host, *REVERSE, offset=counts(4))
    assert host.position == 0
    home(host, *REVERSE)  # the switch is 4 degrees away
    assert host.position == 0


def test_homing_after_several_turns_takes_less_than_a_turn() -> None:
    host = rotation(0)
    host.say(m.MotMoveAbsolute(1, counts(5 * TURN + 10)))
    host.wait(600)
    host.said.clear()
    begin = host.now
    velocity = host.ask(m.MotReqHomeParams(1)).home_velocity
    home(host, *REVERSE)
    [(when, message)] = host.said
    assert message == m.MotMoveHomed(1)
    assert velocity
    assert (when - begin) / SECOND < 10


def test_without_a_switch_homing_goes_on_until_it_is_stopped() -> None:
    host = rotation(90)
    home(host, 0, 0)
    assert host.kinds == []
    assert "homing" in host.bits
    host.say(m.MotMoveStop(1, 1))
    assert host.kinds == ["MOT_MOVE_STOPPED"]
    assert "homed" not in host.bits


def test_a_travel_of_the_user_has_ends() -> None:
    host = MotorHost("K10CR1", travel=counts(90), position=counts(80))
    host.say(m.MotMoveRelative(1, counts(30)))
    host.wait(60)
    assert host.position == counts(10)
    assert "forward_hardware_limit" in host.bits

"""Status bits are correct at every instant, for steppers (page 77) and DC servos (pages 79 and 80)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motor_host import MotorHost

from stagewire_apt import messages as m

ALWAYS = {
    "stepper": {"motor_connected", "interlock_enabled"},
    "dc": {"channel_enabled", "tracking"},
}
MOVING = {"moving_forward", "moving_reverse"}


def motor(name: str) -> MotorHost:
    """Return a motor that moves, jogs and homes at 10,000 counts/s and 20,000 counts/s²."""
    host = MotorHost(name, travel=100_000, position=50_000)
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(m.MotSetJogParams(1, 2, 25_000, 0, 20_000, 10_000, 2))
    host.say(m.MotSetHomeParams(1, 2, 1, 10_000, 0))
    return host


def expect(host: MotorHost, *bits: str) -> None:
    """Check that the given bits and the permanent ones are set; a DC servo is settled only at rest."""
    kind = "dc" if "channel_enabled" in host.bits else "stepper"
    settled = {"settled"} if kind == "dc" and not MOVING & set(bits) else set()
    assert host.bits == {*bits} | ALWAYS[kind] | settled


@pytest.mark.parametrize("name", ["TDC001", "ODC001", "BSC001", "TST001", "MST601"])
def test_the_bits_are_correct_throughout_a_session(name: str) -> None:
    host = motor(name)
    expect(host)
    host.say(m.MotMoveRelative(1, 25_000))
    expect(host, "moving_forward")  # from its first instant
    host.wait(2.99)
    expect(host, "moving_forward")  # to its last
    host.wait(0.01)
    expect(host)
    host.say(m.MotMoveVelocity(1, 2))
    expect(host, "moving_reverse")
    host.wait(1)
    host.say(m.MotMoveRelative(1, 25_000))
    expect(host, "moving_reverse")  # it must slow down first
    host.wait(0.5)
    expect(host, "moving_forward")  # it turns around at this instant
    host.say(m.MotMoveJog(1, 1))
    expect(host, "moving_forward", "jogging_forward")
    host.wait(10)
    expect(host)
    host.say(m.MotMoveJog(1, 2))
    expect(host, "moving_reverse", "jogging_reverse")
    host.wait(1)
    host.say(m.MotMoveStop(1, 2))
    expect(host, "moving_reverse")  # no longer a jog
    host.wait(0.5)
    expect(host)
    host.say(m.MotMoveHome(1))
    expect(host, "moving_reverse", "homing")
    host.wait(60)
    expect(host, "homed", "reverse_hardware_limit")
    host.say(m.MotMoveAbsolute(1, 50_000))
    expect(host, "moving_forward", "homed", "reverse_hardware_limit")
    host.wait(0.1)
    expect(host, "moving_forward", "homed")
    host.wait(60)
    expect(host, "homed")


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@settings(deadline=None, max_examples=25)
@given(st.lists(st.tuples(st.sampled_from("avjhsi"), st.integers(0, 2), st.integers(0, 1500))))
def test_the_motion_bits_agree_with_the_motion(
    name: str, steps: list[tuple[str, int, int]]
) -> None:
    """For any sequence of messages, the bits agree with the position a moment later."""
    host = motor(name)
    commands = {
        "a": lambda value: m.MotMoveAbsolute(1, value * 9_000 - 9_000),
        "v": lambda value: m.MotMoveVelocity(1, value),
        "j": lambda value: m.MotMoveJog(1, value),
        "h": lambda value: m.MotMoveHome(1),
        "s": lambda value: m.MotMoveStop(1, 2),
        "i": lambda value: m.MotMoveStop(1, 1),
    }
    for kind, value, milliseconds in steps:
        host.say(commands[kind](value))
        host.wait(milliseconds / 1000)
        bits, place = host.bits, host._motor._axis.place
        host.wait(1e-6)
        went = host._motor._axis.place - place
        if host._motor._axis.moving:  # at rest the position is rounded to a whole count
            assert ("moving_forward" in bits) == (went > 0)
            assert ("moving_reverse" in bits) == (went < 0)
        else:
            assert not host.bits & MOVING
        assert bits & MOVING != MOVING
    host.say(m.MotMoveStop(1, 1))
    host.said.clear()
    host.wait(100)
    assert host.said == []
    assert not host.bits & (MOVING | {"homing", "jogging_forward", "jogging_reverse"})


def test_both_messages_have_the_same_bits() -> None:
    host = motor("TDC001")
    host.say(m.MotMoveRelative(1, 25_000))
    host.wait(1)
    bits = host.ask(m.MotReqStatusBits(1)).status_bits
    assert bits == host.ask(m.MotReqDcStatusUpdate(1)).status_bits
    assert bits == 0x8000_1010


def test_a_disabled_channel_reports_it() -> None:
    host = motor("TDC001")
    host.say(m.ModSetChanEnableState(1, 2))
    assert host.bits == set()
    assert host.row.state == "disabled"
    host.say(m.ModSetChanEnableState(1, 1))
    expect(host)


def test_settling_takes_its_cycles() -> None:
    """Page 66: the axis must be at rest for a number of cycles of 102.4 µs; 1000 cycles are 102.4 ms."""
    host = motor("BBD101")
    host.say(m.MotSetPmdTrackSettleParams(1, 1000, 20, 0))
    host.wait(1)
    expect(host)
    host.say(m.MotMoveRelative(1, 25_000))
    host.wait(3)
    assert host.bits == ALWAYS["dc"]  # at rest, not yet settled
    assert host.said == []
    host.wait(0.1023)
    assert host.bits == ALWAYS["dc"]
    host.wait(0.0001)
    expect(host)
    [(when, message)] = host.said
    assert when == 4_102_400_000
    assert message.status_bits == 0x8000_3000


@pytest.mark.parametrize(
    ("told", "state"),
    [
        ([], "at rest"),
        ([m.MotMoveRelative(1, 9_000)], "moving forward"),
        ([m.MotMoveJog(1, 2)], "jogging reverse"),
        ([m.MotMoveHome(1)], "homing reverse"),
        ([m.MotMoveVelocity(1, 1), None, m.MotMoveStop(1, 2)], "stopping forward"),
        ([m.MotMoveHome(1), None], "homed"),
    ],
)
def test_the_live_table_describes_the_state(told: list[object], state: str) -> None:
    host = motor("TDC001")
    for message in told:
        if message is None:
            host.wait(0.3 if len(told) > 2 else 60)
        else:
            host.say(message)
    assert host.row.state == state

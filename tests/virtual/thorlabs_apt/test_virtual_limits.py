"""Limits: the ends of the travel, those that software sets, and those of a shortened travel."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

from stagewire import FramedMessage
from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND
from stagewire_virtual.errors import BadOptionError

IGNORE, IMMEDIATE, PROFILED, ROTATION = 1, 2, 3, 0x80
HARD = {"forward_hardware_limit", "reverse_hardware_limit"}
SOFT = {"forward_software_limit", "reverse_software_limit"}


def limited(name: str, mode: int, *, hard: int = 2) -> MotorHost:
    """A motor with soft limits 10,000 counts away, at 10,000 counts/s and 20,000 counts/s²."""
    host = MotorHost(name, travel=100_000, position=50_000)
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(m.MotSetLimSwitchParams(1, hard, hard, 10_000, -10_000, mode))
    return host


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
@pytest.mark.parametrize(
    ("message", "end", "bit"),
    [
        (m.MotMoveVelocity(1, 1), 50_000, "forward_hardware_limit"),
        (m.MotMoveVelocity(1, 2), -50_000, "reverse_hardware_limit"),
        (m.MotMoveAbsolute(1, 0x7FFF_FFFF), 50_000, "forward_hardware_limit"),
        (m.MotMoveRelative(1, -0x8000_0000), -50_000, "reverse_hardware_limit"),
    ],
    ids=lambda value: value.layout.message if isinstance(value, FramedMessage) else "",
)
def test_the_end_of_the_travel_stops_a_motor_and_completes_its_move(
    name: str, message: FramedMessage, end: int, bit: str
) -> None:
    """Page 48: until "a limit switch is reached. Upon completion …"; 0.5 s up, then 10,000 counts/s."""
    host = MotorHost(name, travel=100_000, position=50_000)
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(message)
    host.wait(60)
    [(when, completed)] = host.said
    assert completed.layout.message == "MOT_MOVE_COMPLETED"
    assert when == pytest.approx(5.25 * SECOND, abs=SECOND // 10_000)
    assert completed.position == end == host.position
    if name != "BBD101" or end > 0:  # a brushless stage can go beyond the index mark, its zero
        assert host.bits & HARD == {bit}
    # away from it again
    host.say(m.MotMoveRelative(1, -end))
    host.wait(60)
    assert host.position == 0
    assert not host.bits & HARD


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"travel": 0}, "BSC001 needs a travel of 1 to 2147483647 counts, not 0"),
        ({"travel": 1 << 31}, "BSC001 needs a travel of 1 to 2147483647 counts, not 2147483648"),
        ({"travel": 10, "position": 11}, "BSC001 cannot stand at 11 of a travel of 10"),
        ({"position": -1}, "BSC001 cannot stand at -1 of a travel of 2500000"),
    ],
)
def test_a_stage_stands_within_its_travel(settings: dict[str, int], sentence: str) -> None:
    with pytest.raises(BadOptionError, match=sentence):
        MotorHost("BSC001", **settings)


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
def test_who_stands_at_an_end_does_not_go_beyond(name: str) -> None:
    """Nor does it say so: the move is completed at the instant at which it would begin."""
    host = MotorHost(name, travel=100_000, position=100_000)
    assert "forward_hardware_limit" in host.bits
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(0)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert "moving_forward" not in host.bits
    host.wait(1)
    assert (host.position, host.now) == (0, SECOND)
    host.say(m.MotMoveRelative(1, -1_000))  # away from it, and not to be stopped there
    host.wait(10)
    assert host.position == -1_000


def test_who_stands_at_a_soft_limit_does_not_go_beyond() -> None:
    host = limited("BSC001", IMMEDIATE)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(10)
    host.said.clear()
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(0)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert host.position == 10_000
    assert "moving_forward" not in host.bits


def test_a_target_at_the_end_is_reached_with_the_whole_profile() -> None:
    host = MotorHost("TDC001", travel=100_000, position=75_000)
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(m.MotMoveRelative(1, 25_000))
    host.wait(10)
    assert [when for when, _ in host.said] == [3 * SECOND]
    assert "forward_hardware_limit" in host.bits


def test_a_switch_that_is_ignored_is_not_reported() -> None:
    host = limited("TDC001", IGNORE, hard=1)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(60)
    assert host.position == 50_000
    assert not host.bits & HARD


@pytest.mark.parametrize("hard", [2, 3, 0x82, 0x83])
def test_any_other_switch_is(hard: int) -> None:
    host = limited("BSC001", IGNORE, hard=hard)
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(60)
    assert host.bits & HARD == {"reverse_hardware_limit"}


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@pytest.mark.parametrize("rotation", [0, ROTATION])
@pytest.mark.parametrize(("mode", "beyond", "after"), [(IMMEDIATE, 0, 0), (PROFILED, 2_500, 0.5)])
@pytest.mark.parametrize(("direction", "sign"), [(1, 1), (2, -1)])
def test_a_soft_limit_stops_at_once_or_from_there_on(
    name: str, rotation: int, mode: int, beyond: int, after: float, direction: int, sign: int
) -> None:
    """10,000 counts are 1.25 s away; a stop from 10,000 counts/s takes 0.5 s and 2,500 counts."""
    host = limited(name, mode | rotation)
    host.say(m.MotMoveVelocity(1, direction))
    host.wait(60)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_COMPLETED"
    assert when == pytest.approx((1.25 + after) * SECOND, abs=SECOND // 10_000)
    assert abs(message.position - sign * (10_000 + beyond)) <= (1 if beyond else 0)


@pytest.mark.parametrize("mode", [IMMEDIATE, PROFILED])
def test_who_is_beyond_a_soft_limit_gets_back_but_no_farther(mode: int) -> None:
    host = limited("BSC001", IGNORE)
    host.say(m.MotMoveAbsolute(1, 20_000))
    host.wait(10)
    host.say(m.MotSetLimSwitchParams(1, 2, 2, 10_000, -10_000, mode))
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(10)
    assert abs(host.position - 20_000) <= 2
    host.say(m.MotMoveAbsolute(1, 0))
    host.wait(10)
    assert host.position == 0
    assert host.kinds == ["MOT_MOVE_COMPLETED"] * 3


@pytest.mark.parametrize("mode", [IGNORE, IGNORE | ROTATION, 0])
def test_soft_limits_that_are_ignored_stop_nothing_and_say_nothing(mode: int) -> None:
    host = limited("BSC001", mode)
    host.say(m.MotMoveAbsolute(1, 30_000))
    host.wait(60)
    assert host.position == 30_000
    assert not host.bits & SOFT


def test_a_stepper_says_which_soft_limit_it_is_at() -> None:
    host = limited("BSC001", IMMEDIATE)
    assert not host.bits & SOFT
    for direction, bit in ((1, "forward_software_limit"), (2, "reverse_software_limit")):
        host.say(m.MotMoveVelocity(1, direction))
        host.wait(60)
        assert host.bits & SOFT == {bit}


def test_soft_limits_are_positions_and_follow_the_counter() -> None:
    host = limited("TDC001", IMMEDIATE)
    host.say(m.MotSetPosCounter(1, 4_000))
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(60)
    assert host.position == 10_000
    assert (
        host.instrument.channel(1).behaviour._axis.place == 56_000
    )  # six thousand from where it stood


def test_a_travel_can_only_be_shortened() -> None:
    """Page 75: a set can only raise the minimum and lower the maximum, and changes nothing else."""
    host = MotorHost("BBD102", travel=100_000, position=50_000)
    before = host.ask(m.MotReqPmdStageAxisParams(1))
    wanted = {
        name: getattr(before, name) for name in before.layout.fields if name[:8] != "reserved"
    }
    for minimum, maximum, expected in [
        (10_000, 90_000, (10_000, 90_000)),
        (0, 100_000, (10_000, 90_000)),
        (20_000, 200_000, (20_000, 90_000)),
        (95_000, 96_000, (20_000, 90_000)),  # nothing would be left
    ]:
        wanted.update(min_pos=minimum, max_pos=maximum, serial_num=1, part_no_axis="other")
        host.say(m.MotSetPmdStageAxisParams(**wanted))
        after = host.ask(m.MotReqPmdStageAxisParams(1))
        assert (after.min_pos, after.max_pos) == expected
        assert (after.serial_num, after.part_no_axis) == (before.serial_num, before.part_no_axis)
    for direction, position in ((1, 40_000), (2, -30_000)):
        host.say(m.MotMoveVelocity(1, direction))
        host.wait(60)
        assert host.position == position

"""Limits: the ends of the travel, soft limits, and a shortened travel."""

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
    """Return a motor with soft limits at ±10,000 counts, 10,000 counts/s and 20,000 counts/s²."""
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
    """Page 48: until "a limit switch is reached. Upon completion …". It accelerates for 0.5 s."""
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
    # and back
    host.say(m.MotMoveRelative(1, -end))
    host.wait(60)
    assert host.position == 0
    assert not host.bits & HARD


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"travel": 0}, "BSC001 requires a travel of 1 to 2147483647 counts, not 0"),
        ({"travel": 1 << 31}, "BSC001 requires a travel of 1 to 2147483647 counts, not 2147483648"),
        ({"travel": 10, "position": 11}, "BSC001 cannot start at 11 within a travel of 10"),
        ({"position": -1}, "BSC001 cannot start at -1 within a travel of 2500000"),
    ],
)
def test_a_position_outside_the_travel_is_refused(settings: dict[str, int], sentence: str) -> None:
    with pytest.raises(BadOptionError, match=sentence):
        MotorHost("BSC001", **settings)


@pytest.mark.parametrize("name", ["TDC001", "BSC001", "BBD101"])
def test_a_motor_at_an_end_does_not_move_further(name: str) -> None:
    """The move is completed at the instant at which it would begin, without motion bits."""
    host = MotorHost(name, travel=100_000, position=100_000)
    assert "forward_hardware_limit" in host.bits
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(0)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    assert "moving_forward" not in host.bits
    host.wait(1)
    assert (host.position, host.now) == (0, SECOND)
    host.say(m.MotMoveRelative(1, -1_000))  # away from the end, where nothing stops it
    host.wait(10)
    assert host.position == -1_000


def test_a_motor_at_a_soft_limit_does_not_move_further() -> None:
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


def test_an_ignored_switch_is_not_reported() -> None:
    host = limited("TDC001", IGNORE, hard=1)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(60)
    assert host.position == 50_000
    assert not host.bits & HARD


@pytest.mark.parametrize("hard", [2, 3, 0x82, 0x83])
def test_any_other_switch_is_reported(hard: int) -> None:
    host = limited("BSC001", IGNORE, hard=hard)
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(60)
    assert host.bits & HARD == {"reverse_hardware_limit"}


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@pytest.mark.parametrize("rotation", [0, ROTATION])
@pytest.mark.parametrize(("mode", "beyond", "after"), [(IMMEDIATE, 0, 0), (PROFILED, 2_500, 0.5)])
@pytest.mark.parametrize(("direction", "sign"), [(1, 1), (2, -1)])
def test_a_soft_limit_stops_immediately_or_with_a_profile(
    name: str, rotation: int, mode: int, beyond: int, after: float, direction: int, sign: int
) -> None:
    """The limit is reached after 1.25 s; a stop from 10,000 counts/s takes 0.5 s and 2,500 counts."""
    host = limited(name, mode | rotation)
    host.say(m.MotMoveVelocity(1, direction))
    host.wait(60)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_COMPLETED"
    assert when == pytest.approx((1.25 + after) * SECOND, abs=SECOND // 10_000)
    assert abs(message.position - sign * (10_000 + beyond)) <= (1 if beyond else 0)


@pytest.mark.parametrize("mode", [IMMEDIATE, PROFILED])
def test_a_motor_beyond_a_soft_limit_can_only_return(mode: int) -> None:
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
def test_ignored_soft_limits_neither_stop_nor_report(mode: int) -> None:
    host = limited("BSC001", mode)
    host.say(m.MotMoveAbsolute(1, 30_000))
    host.wait(60)
    assert host.position == 30_000
    assert not host.bits & SOFT


def test_a_stepper_reports_the_active_soft_limit() -> None:
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
    )  # 6,000 counts from its first place


def test_a_travel_can_only_be_shortened() -> None:
    """Page 75: the SET can only raise the minimum and lower the maximum."""
    host = MotorHost("BBD102", travel=100_000, position=50_000)
    before = host.ask(m.MotReqPmdStageAxisParams(1))
    wanted = {
        name: getattr(before, name) for name in before.layout.fields if name[:8] != "reserved"
    }
    for minimum, maximum, expected in [
        (10_000, 90_000, (10_000, 90_000)),
        (0, 100_000, (10_000, 90_000)),
        (20_000, 200_000, (20_000, 90_000)),
        (95_000, 96_000, (20_000, 90_000)),  # no travel would be left
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

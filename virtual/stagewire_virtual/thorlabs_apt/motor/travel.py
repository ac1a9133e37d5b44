"""The limits of the travel (pages 39, 40, 76 and 77), and homing (pages 37 and 41)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from stagewire_apt.enumerations import HardLimit, MoveDirection, SoftwareLimitMode
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.motor.moves import GoTo, Move, Pace, RunOn

_SET = "MOT_LIMSWITCHPARAMS"
_STOPPING = (SoftwareLimitMode.STOP_IMMEDIATE, SoftwareLimitMode.STOP_PROFILED)


@dataclass(frozen=True, slots=True)
class Limit:
    """A place that a motor must not pass.

    :param place: its position, in counts from the lower end of the travel.
    :param direction: the direction in which it must not be passed: 1 upwards, -1 downwards.
    :param profiled: whether the motor decelerates from there on, or stops immediately.
    """

    place: int
    direction: int
    profiled: bool = False


def soft_limits(channel: Channel, origin: int) -> Iterator[Limit]:
    """Yield the soft limits; ``origin`` is the place where the position counter is 0.

    The limits of MOT_LIMSWITCHPARAMS are positions of the counter; a profiled stop begins at the limit. Those
    of MOT_PMDSTAGEAXISPARAMS shorten the travel of the stage and do not depend on the counter.
    """
    mode = _mode(channel)
    if mode in _STOPPING:
        profiled = mode == SoftwareLimitMode.STOP_PROFILED
        for way in (1, -1):
            limit = channel.parameter(_SET, f"{_turn(channel, way)}_soft_limit")
            yield Limit(origin + limit, way, profiled)
    stage = channel.parameters.get("MOT_PMDSTAGEAXISPARAMS")
    if stage:
        yield Limit(stage["max_pos"], 1)
        yield Limit(stage["min_pos"], -1)


def active_limits(channel: Channel, axis: SimulatedAxis, position: int) -> dict[str, bool]:
    """Return the limit bits of the status by name.

    An ignored hardware limit is not reported, although the travel still ends there. Clockwise is forward
    (page 77).
    """
    place = axis.place
    soft = _mode(channel) in _STOPPING
    ends = not axis.endless
    at_end = {1: ends and place >= axis.travel, -1: ends and place <= -axis.below}
    bits = {}
    for way, forward in ((channel.clockwise, "forward"), (-channel.clockwise, "reverse")):
        limit = channel.parameter(_SET, f"{_turn(channel, way)}_soft_limit")
        bits[f"{forward}_hardware_limit"] = at_end[way] and heeds(channel, way)
        bits[f"{forward}_software_limit"] = soft and (position - limit) * way >= 0
    return bits


def heeds(channel: Channel, way: int) -> bool:
    """Return whether the switch at an end of the travel, 1 for the upper one, is not set to be ignored."""
    setting = channel.parameter(_SET, f"{_turn(channel, way)}_hard_limit", HardLimit.MAKES)
    return setting & ~HardLimit.SWAPPED != HardLimit.IGNORE


def _turn(channel: Channel, way: int) -> str:
    """Return the turn, ``cw`` or ``ccw``, that raises (1) or lowers (-1) positions."""
    return "cw" if way == channel.clockwise else "ccw"


def _mode(channel: Channel) -> int:
    mode = channel.parameter(_SET, "software_limit_mode", SoftwareLimitMode.IGNORE)
    return mode & ~SoftwareLimitMode.ROTATION_STAGE


_SWITCHES = {1: -1, 4: 1}
"""Home switch -> its end of the travel. Issue 3 has no values; public drivers use these."""


@dataclass(frozen=True, slots=True)
class Homing:
    """The moves of a homing run, and its result.

    :param ways: the moves in order.
    :param found: whether the stage is home at their end; otherwise it is at a wrong end of its travel.
    """

    ways: tuple[Move, ...]
    found: bool


def index_run(travel: int) -> int:
    """Return how far a stage can move below its index mark: a hundredth of its travel."""
    return travel // 100 + 1


def homing(channel: Channel, axis: SimulatedAxis, pace: Pace) -> Homing:
    """Return the homing run of a channel from the present position, to an index mark or a switch."""
    return _to_index(axis, pace) if axis.below else _to_switch(channel, axis, pace)


def _to_index(axis: SimulatedAxis, pace: Pace) -> Homing:
    """Return the homing run of a brushless stage, which uses no switch (page 37).

    Its index mark is at the beginning of the travel, so that positions are 0 to the maximum afterwards (page
    76). It moves below the mark and then onto it: "homing direction is always positive". A stage without ends
    moves on to its next mark.
    """
    if axis.endless:
        return Homing((GoTo(_next_turn(axis, 1), pace),), found=True)
    return Homing((GoTo(-axis.below, pace), GoTo(0, pace)), found=True)


def _to_switch(channel: Channel, axis: SimulatedAxis, pace: Pace) -> Homing:
    """Return the homing run to a limit switch: onto the switch, then back by the offset distance.

    Direction 1 is forward, every other value is reverse. Without a switch in that direction, or with an
    ignored one (page 39), the stage runs into the end of its travel, as real stages do whose home parameters
    are zeros. A stage without ends has one switch, once a turn, which either setting may describe: a public
    driver homes the K10CR1 with the reverse one ignored (github
    MSLNZ/msl-equipment/packages/resources/src/msl/equipment_resources/thorlabs/k10cr.py). If both are
    ignored, it runs until it is stopped.
    """
    parameter = channel.parameter
    forward = parameter("MOT_HOMEPARAMS", "home_direction") == MoveDirection.FORWARD
    direction = 1 if forward else -1
    switch = _SWITCHES.get(parameter("MOT_HOMEPARAMS", "limit_switch"))
    directions = (direction, -direction) if axis.endless else (direction,)
    found = switch == direction and any(heeds(channel, each) for each in directions)
    run: Move = RunOn(direction, pace)
    end = axis.travel if forward else 0
    if axis.endless:
        end = _next_turn(axis, direction)
        run = GoTo(end, pace) if found else run
    home = end - direction * parameter("MOT_HOMEPARAMS", "offset_distance")
    return Homing((run, GoTo(home, pace)) if found else (run,), found)


def _next_turn(axis: SimulatedAxis, direction: int) -> int:
    """Return the next whole turn in a direction; the present position if it is one."""
    turns = axis.place * direction / axis.travel
    return direction * math.ceil(turns) * axis.travel

"""The ends of the travel, and home.

Limits stop a motor, and it says which of them are active (pages 39, 40, 76 and 77). Homing goes to a switch
or an index mark (pages 37 and 41).
"""

from __future__ import annotations

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

    :param place: where it is, in counts from the lower end of the travel.
    :param direction: in which it must not be passed: 1 to higher places, -1 to lower ones.
    :param profiled: whether it slows down from there on, or stops at once.
    """

    place: int
    direction: int
    profiled: bool = False


def soft_limits(channel: Channel, origin: int) -> Iterator[Limit]:
    """Yield the limits that software sets; ``origin`` is the place where the position counter is 0.

    Those of MOT_LIMSWITCHPARAMS are positions; a profiled stop begins at the limit. Those of
    MOT_PMDSTAGEAXISPARAMS shorten the travel of the stage, whatever its counter says.
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

    A hardware limit that is to be ignored is not reported; the travel of a stage ends there nevertheless.
    Clockwise is forward (page 77).
    """
    place = axis.place
    soft = _mode(channel) in _STOPPING
    at_end = {1: place >= axis.travel, -1: place <= -axis.below}
    bits = {}
    for way, forward in ((channel.clockwise, "forward"), (-channel.clockwise, "reverse")):
        limit = channel.parameter(_SET, f"{_turn(channel, way)}_soft_limit")
        bits[f"{forward}_hardware_limit"] = at_end[way] and heeds(channel, way)
        bits[f"{forward}_software_limit"] = soft and (position - limit) * way >= 0
    return bits


def heeds(channel: Channel, way: int) -> bool:
    """Say whether the switch at an end of the travel is there and not to be ignored; 1 is the upper end."""
    setting = channel.parameter(_SET, f"{_turn(channel, way)}_hard_limit", HardLimit.MAKES)
    return setting & ~HardLimit.SWAPPED != HardLimit.IGNORE


def _turn(channel: Channel, way: int) -> str:
    """Return the turn, ``cw`` or ``ccw``, by which positions go up (1) or down (-1)."""
    return "cw" if way == channel.clockwise else "ccw"


def _mode(channel: Channel) -> int:
    mode = channel.parameter(_SET, "software_limit_mode", SoftwareLimitMode.IGNORE)
    return mode & ~SoftwareLimitMode.ROTATION_STAGE


_SWITCHES = {1: -1, 4: 1}
"""Home switch -> the end where it is. Issue 3 gives no values; public drivers use these."""


@dataclass(frozen=True, slots=True)
class Homing:
    """The ways to home, and whether it is there.

    :param ways: one after the other.
    :param found: whether it is home at their end; otherwise it stands at a wrong end of its travel.
    """

    ways: tuple[Move, ...]
    found: bool


def index_run(travel: int) -> int:
    """Return how far a stage with an index mark can be driven beyond it: a hundredth of its travel."""
    return travel // 100 + 1


def homing(channel: Channel, axis: SimulatedAxis, pace: Pace) -> Homing:
    """Return how the stage of a channel homes from where it is now; one with an index mark goes below it."""
    return _to_index(axis, pace) if axis.below else _to_switch(channel, axis, pace)


def _to_index(axis: SimulatedAxis, pace: Pace) -> Homing:
    """Home a brushless stage: "homing direction is always positive", and no switch is used (page 37).

    Its index mark is where the travel begins, so that positions are 0 to the maximum afterwards (page 76). It
    goes below the mark, and comes to it in positive direction.
    """
    return Homing((GoTo(-axis.below, pace), GoTo(0, pace)), found=True)


def _to_switch(channel: Channel, axis: SimulatedAxis, pace: Pace) -> Homing:
    """Home by a limit switch: run onto it, then go back by the offset distance, which is home.

    The direction is 1 for forward, and reverse for every other value. Without a switch in that direction, or
    with one that is to be ignored (page 39), a stage runs into the end of its travel, as stages do whose home
    parameters have been set to zeros.
    """
    parameter = channel.parameter
    forward = parameter("MOT_HOMEPARAMS", "home_direction") == MoveDirection.FORWARD
    direction = 1 if forward else -1
    switch = _SWITCHES.get(parameter("MOT_HOMEPARAMS", "limit_switch"))
    found = switch == direction and heeds(channel, direction)
    end = axis.travel if forward else 0
    home = end - direction * parameter("MOT_HOMEPARAMS", "offset_distance")
    run = RunOn(direction, pace)
    return Homing((run, GoTo(home, pace)) if found else (run,), found)

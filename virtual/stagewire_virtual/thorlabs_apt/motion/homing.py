"""Where home is, and how a motor gets there (pages 37 and 41)."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_apt.enumerations import MoveDirection
from stagewire_virtual.motion import Axis
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.motion.limits import heeds
from stagewire_virtual.thorlabs_apt.motion.ways import GoTo, Pace, RunOn, Way

__all__ = ["Homing", "homing", "index_run"]

_SWITCHES = {1: -1, 4: 1}
"""Home switch -> the end where it is. Issue 3 gives no values; public drivers use these."""


@dataclass(frozen=True, slots=True)
class Homing:
    """The ways to home, and whether it is there.

    :param ways: one after the other.
    :param found: whether it is home at their end; otherwise it stands at a wrong end of its travel.
    """

    ways: tuple[Way, ...]
    found: bool


def index_run(travel: int) -> int:
    """Return how far a stage with an index mark can be driven beyond it: a hundredth of its travel."""
    return travel // 100 + 1


def homing(channel: Channel, axis: Axis, pace: Pace) -> Homing:
    """Return how the stage of a channel homes from where it is now; one with an index mark goes below it."""
    return _to_index(axis, pace) if axis.below else _to_switch(channel, axis, pace)


def _to_index(axis: Axis, pace: Pace) -> Homing:
    """Home a brushless stage: "homing direction is always positive", and no switch is used (page 37).

    Its index mark is where the travel begins, so that positions are 0 to the maximum afterwards (page 76). It
    goes below the mark, and comes to it in positive direction.
    """
    return Homing((GoTo(-axis.below, pace), GoTo(0, pace)), found=True)


def _to_switch(channel: Channel, axis: Axis, pace: Pace) -> Homing:
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

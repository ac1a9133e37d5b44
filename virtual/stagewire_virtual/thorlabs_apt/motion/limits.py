"""Limits that stop a motor, and those that it says are active (pages 39, 40, 76 and 77)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stagewire_apt.enumerations import HardLimit, SoftwareLimitMode
from stagewire_virtual.motion import Axis
from stagewire_virtual.thorlabs_apt.channel import Channel

__all__ = ["Limit", "active_limits", "heeds", "soft_limits"]

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


def active_limits(channel: Channel, axis: Axis, position: int) -> dict[str, bool]:
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

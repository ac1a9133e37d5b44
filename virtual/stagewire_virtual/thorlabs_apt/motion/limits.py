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

    :param place: where it is, in counts from the reverse end of the travel.
    :param direction: in which it must not be passed: 1 forward, -1 reverse.
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
        yield Limit(origin + channel.parameter(_SET, "cw_soft_limit"), 1, profiled)
        yield Limit(origin + channel.parameter(_SET, "ccw_soft_limit"), -1, profiled)
    stage = channel.parameters.get("MOT_PMDSTAGEAXISPARAMS")
    if stage:
        yield Limit(stage["max_pos"], 1)
        yield Limit(stage["min_pos"], -1)


def active_limits(channel: Channel, axis: Axis, position: int) -> dict[str, bool]:
    """Return the limit bits of the status by name.

    A hardware limit that is to be ignored is not reported; a stage stops at the end of its travel all the
    same. Clockwise is forward (page 77).
    """
    place = axis.place
    soft = _mode(channel) in _STOPPING
    return {
        "forward_hardware_limit": place >= axis.travel and heeds(channel, 1),
        "reverse_hardware_limit": place <= -axis.below and heeds(channel, -1),
        "forward_software_limit": soft and position >= channel.parameter(_SET, "cw_soft_limit"),
        "reverse_software_limit": soft and position <= channel.parameter(_SET, "ccw_soft_limit"),
    }


def heeds(channel: Channel, direction: int) -> bool:
    """Say whether the switch at an end of the travel is there and not to be ignored; 1 is the forward end."""
    switch = "cw_hard_limit" if direction > 0 else "ccw_hard_limit"
    setting = channel.parameter(_SET, switch, HardLimit.MAKES)
    return setting & ~HardLimit.SWAPPED != HardLimit.IGNORE


def _mode(channel: Channel) -> int:
    mode = channel.parameter(_SET, "software_limit_mode", SoftwareLimitMode.IGNORE)
    return mode & ~SoftwareLimitMode.ROTATION_STAGE

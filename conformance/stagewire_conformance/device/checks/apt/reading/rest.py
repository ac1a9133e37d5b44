"""Whether a status says that nothing moves when nothing does; nothing was asked to (pages 69, 77 and 79)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.checks.apt.reading.agreement import (
    ENABLED,
    Difference,
    Look,
    enabling,
)
from stagewire_conformance.device.checks.apt.reading.channel_status import ChannelStatus

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Heard
    from stagewire_conformance.device.trial import Trial


_PAUSE: Final = 0.1
"""Seconds between two looks."""

_CREEP: Final = 100
"""Counts that a position may creep in that time though nothing moves: a loop holds it within fewer."""


def looks_at_rest(channel: ChannelStatus) -> list[Look]:
    """Return the looks that apply to a channel."""
    has_velocity = channel.moving and "velocity" in channel.fields
    return [*([_motion] if channel.moving else []), *([_velocity] if has_velocity else [])]


def _motion(trial: Trial, channel: ChannelStatus) -> Difference | None:
    """Look whether the bits of motion and the position agree."""
    first, second = _twice(trial, channel)
    position = second.message.position
    went = position - first.message.position
    bits, more = (each.message.status_bits & channel.moving for each in (first, second))
    if bits & more and not went:
        names = ", ".join(name for name, mask in channel.masks.items() if bits & more & mask)
        return Difference(
            f"{second.name} says {names}, though the position stays at {position} for {_PAUSE:g} s; nothing "
            "was set in motion",
            second.raw,
        )
    if abs(went) > _CREEP and not bits | more and _is_held(trial, channel):
        return Difference(
            f"{second.name} has the position {position}, {went:+d} in {_PAUSE:g} s, and no bit that says "
            "that it moves; nothing was set in motion",
            second.raw,
        )
    return None


def _velocity(trial: Trial, channel: ChannelStatus) -> Difference | None:
    first, second = _twice(trial, channel)
    rests = first.message.position == second.message.position
    speeds = first.message.velocity, second.message.velocity
    if not rests or not all(speeds):
        return None
    return Difference(
        f"{second.name} has the velocity {speeds[1]}, though the position stays at "
        f"{second.message.position}; at rest it is 0",
        second.raw,
    )


def _twice(trial: Trial, channel: ChannelStatus) -> tuple[Heard, Heard]:
    first = channel.get(trial)
    trial.line.listen(_PAUSE)
    return first, channel.get(trial)


def _is_held(trial: Trial, channel: ChannelStatus) -> bool:
    """Return whether a loop holds the stage; one that nothing holds may be pushed."""
    if not channel.claims(ENABLED):
        return False
    state: int = channel.ask(trial, ENABLED).message.enable_state
    return state == enabling(trial)

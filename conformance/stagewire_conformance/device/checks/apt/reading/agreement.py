"""Comparisons of a status with other replies about the same channel.

The values are read one after the other, so a live value may differ for a moment: a loop holds a position only
to within a count or two. Therefore a comparison is repeated before a difference counts, and values that
change during the comparison are ignored.

A status must also show no motion when no motion was requested (pages 69, 77 and 79).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from stagewire_conformance.device.causes import MOTION_AT_REST
from stagewire_conformance.device.checks.apt.reading.channel_status import ChannelStatus

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.trial import Trial

POSITION: Final = "MOT_GET_POSCOUNTER"
ENABLED: Final = "MOD_GET_CHANENABLESTATE"
CLOSED_LOOP: Final = "PZ_GET_POSCONTROLMODE"


_DITHER: Final = 10
"""Counts by which a position that is not at rest may differ."""


class Difference(NamedTuple):
    """Two values that should agree and do not.

    :param text: a sentence.
    :param aspect: what differs.
    :param came: the bytes of the message at fault.
    """

    text: str
    aspect: str
    came: bytes


Look = Callable[["Trial", ChannelStatus], Difference | None]
"""Compares two values once."""


def agreements(channel: ChannelStatus) -> list[Look]:
    """Return the comparisons that apply to a channel."""
    has_position = "position" in channel.fields
    applies: dict[Look, bool] = {
        _position: channel.claims(POSITION) and has_position,
        _bits_alone: channel.bits_alone is not None,
        _by_itself: channel.query is not None and not channel.stream.skip,
        _closed_loop: channel.claims(CLOSED_LOOP) and "closed_loop" in channel.masks,
    }
    return [look for look, does in applies.items() if does]


def _position(trial: Trial, channel: ChannelStatus) -> Difference | None:
    before = channel.ask(trial, POSITION)
    status = channel.get(trial)
    return _other_position(before, status, channel.ask(trial, POSITION))


def _bits_alone(trial: Trial, channel: ChannelStatus) -> Difference | None:
    assert channel.bits_alone is not None  # else it does not apply
    before = channel.get(trial)
    alone = channel.ask(trial, channel.bits_alone)
    shared = channel.masks_shared_with(channel.bits_alone)
    return _other_bits(shared, before, alone, channel.get(trial))


def _by_itself(trial: Trial, channel: ChannelStatus) -> Difference | None:
    """Compare the periodic status with the requested one."""
    before = channel.get(trial)
    told = channel.next(trial)
    after = channel.get(trial)
    different = _other_position(before, told, after) if "position" in channel.fields else None
    return different or _other_bits(channel.masks, before, told, after)


def _other_position(before: Incoming, told: Incoming, after: Incoming) -> Difference | None:
    """Compare a count with the counts read before and after it, with a margin if it is changing."""
    low, high = sorted((before.message.position, after.message.position))
    position = told.message.position
    margin = 3 * (high - low) + _DITHER if high > low else 0
    if low - margin <= position <= high + margin:
        return None
    as_well = f"{low}" if low == high else f"{low} to {high}"
    return Difference(
        f"{_which(told, after)} has the position {position}, but {after.name}, read before and "
        f"after it, has {as_well}; they should be the same count",
        "position",
        told.raw,
    )


def _other_bits(
    masks: Mapping[str, int], before: Incoming, told: Incoming, after: Incoming
) -> Difference | None:
    if not masks:
        return None
    bits, due = told.message.status_bits, after.message.status_bits
    differing = (bits ^ due) & ~(before.message.status_bits ^ due)
    names = [name for name, mask in masks.items() if differing & mask]
    if not names:
        return None
    return Difference(
        f"{_which(told, after)} has the status bits {bits:#010x}, but {after.name}, read before "
        f"and after it, has {due:#010x}; they differ in {', '.join(names)} and should be the same",
        "status_bits",
        told.raw,
    )


def _which(told: Incoming, other: Incoming) -> str:
    return f"periodic {told.name}" if told.name == other.name else told.name


def enabled(trial: Trial, channel: ChannelStatus) -> Difference | None:
    """Compare the enabled bit of the status with the enable state."""
    state = channel.ask(trial, ENABLED)
    said: int = state.message.enable_state
    return _bit(
        trial,
        channel,
        "channel_enabled",
        said == enabling(trial),
        f"{state.name} has the state {said}",
    )


def _closed_loop(trial: Trial, channel: ChannelStatus) -> Difference | None:
    mode = channel.ask(trial, CLOSED_LOOP)
    said: int = mode.message.mode
    modes = trial.declared.registry.fields(CLOSED_LOOP, "header")["mode"]["enum"]
    closed = {value for name, value in modes.items() if name.startswith("CLOSED")}
    return _bit(trial, channel, "closed_loop", said in closed, f"{mode.name} has the mode {said}")


def _bit(
    trial: Trial, channel: ChannelStatus, bit: str, due: bool, reason: str
) -> Difference | None:
    status = channel.get(trial)
    bits, mask = status.message.status_bits, channel.masks[bit]
    if bool(bits & mask) == due:
        return None
    return Difference(
        f"{status.name} has the status bits {bits:#010x}; bit {bit} ({mask:#010x}) should be "
        f"{'set' if due else '0'}, because {reason}",
        bit,
        status.raw,
    )


def enabling(trial: Trial) -> int:
    """Return the enable state for "enabled"."""
    states = trial.declared.registry.fields(ENABLED, "header")["enable_state"]["enum"]
    return int(states["ENABLE"])


_PAUSE: Final = 0.1
"""Seconds between two readings."""

_CREEP: Final = 100
"""The most counts that a position moves in that time without motion: a loop holds it more tightly."""


def looks_at_rest(channel: ChannelStatus) -> list[Look]:
    """Return the comparisons for a channel at rest."""
    if not channel.moving or "position" not in channel.fields:
        return []
    return [_motion, *([_velocity] if "velocity" in channel.fields else [])]


def _motion(trial: Trial, channel: ChannelStatus) -> Difference | None:
    """Compare the motion bits with the position."""
    first, second = _twice(trial, channel)
    position = second.message.position
    went = position - first.message.position
    bits, more = (each.message.status_bits & channel.moving for each in (first, second))
    if bits & more and not went:
        names = ", ".join(name for name, mask in channel.masks.items() if bits & more & mask)
        return Difference(
            f"{second.name} reports {names}, but the position stays at {position} for "
            f"{_PAUSE:g} s and no motion was requested",
            MOTION_AT_REST,
            second.raw,
        )
    if abs(went) > _CREEP and not bits | more and _is_held(trial, channel):
        return Difference(
            f"{second.name} has the position {position}, {went:+d} counts in {_PAUSE:g} s, but "
            "no motion bit is set and no motion was requested",
            MOTION_AT_REST,
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
        f"{second.name} has the velocity {speeds[1]}, but the position stays at "
        f"{second.message.position}; at rest the velocity should be 0",
        "velocity at rest",
        second.raw,
    )


def _twice(trial: Trial, channel: ChannelStatus) -> tuple[Incoming, Incoming]:
    first = channel.get(trial)
    trial.line.listen(_PAUSE)
    return first, channel.get(trial)


def _is_held(trial: Trial, channel: ChannelStatus) -> bool:
    """Return whether a loop holds the stage; otherwise something may push it."""
    if not channel.claims(ENABLED):
        return False
    state: int = channel.ask(trial, ENABLED).message.enable_state
    return state == enabling(trial)

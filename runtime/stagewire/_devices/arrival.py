"""Whether a motion that has ended has reached its target.

The documents state no tolerance. The default is a decision of this library: servos report the end of a
move when their trajectory ends, some tens of counts before they stand on the target, and steppers report
the counts that were commanded. Both are far below 0.01 mm, and a limit switch is far above.
"""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import Any, Final

from stagewire._devices.calls import look, moves
from stagewire._devices.limits import PER_MM, POSITION
from stagewire._devices.line import Deadline
from stagewire._devices.spot import Spot
from stagewire._devices.tables import MotionEnd
from stagewire._devices.targets import position_in
from stagewire._devices.values import Values
from stagewire.errors import ReplyTimeoutError, TargetNotReachedError, UnknownScaleError
from stagewire.quantities import Scale

__all__ = ["TOLERANCE_COUNTS", "TOLERANCE_MM", "checked"]

TOLERANCE_MM: Final = Fraction(1, 100)
"""How far from its target a motion may end, where the scale of the position is known."""
TOLERANCE_COUNTS: Final = 500
"""How far, where no scale is known: 0.015 mm of the stages with the finest encoders of the document."""
_PAUSE: Final = 0.1
"""Seconds between two questions about what still moves."""


async def checked(
    spot: Spot, what: str, targets: tuple[int, ...], end: MotionEnd, deadline: Deadline
) -> MotionEnd:
    """Return how a motion ended, if it ended on its target, or on one of several.

    The status is asked for where the end carries no position, and again where the position is off the target
    while the bits of the controller still show motion, until they show none or the time is over.

    Raises :class:`~stagewire.errors.TargetNotReachedError`, and
    :class:`~stagewire.errors.ReplyTimeoutError` where the question gets no answer.
    """
    said, asked = end.values, False
    tolerance = _tolerance(spot)
    status = spot.connection.unit.status_query
    while True:
        position = position_in(said)
        if position is not None and abs(_miss(targets, position)) <= tolerance:
            return MotionEnd(end.message, said, end.seconds)
        done = position is not None and (not _shows_motion(spot, said) or (asked and deadline.over))
        if done or status is None:
            break
        if asked:
            await spot.line.pause(_PAUSE)
        try:
            said, asked = await look(spot, status, spot.seconds(None)), True
        except ReplyTimeoutError as error:
            raise ReplyTimeoutError(f"{what} has ended, and nobody knows where: {error}") from None
    if position is None:
        return end  # the unit cannot say where it is
    raise _missed(
        spot, what, targets, position, tolerance, MotionEnd(end.message, said, end.seconds)
    )


def _miss(targets: tuple[int, ...], position: int) -> int:
    """Return how far the nearest target is from a position, with its sign."""
    return min((target - position for target in targets), key=abs)


def _shows_motion(spot: Spot, values: Values[Any] | None) -> bool:
    moving = None if values is None else spot.connection.unit.moving.get(type(values.message))
    return moving is not None and moves(values.message, moving)  # type: ignore[union-attr]


def _tolerance(spot: Spot) -> int:
    """Return the tolerance in counts."""
    choices, scale = spot.connection.choices, _scale(spot)
    if choices.target_tolerance_counts is not None:
        return choices.target_tolerance_counts
    if scale is None or scale.unit not in PER_MM:
        return TOLERANCE_COUNTS
    mm = choices.target_tolerance_mm
    length = (TOLERANCE_MM if mm is None else mm) * PER_MM[scale.unit]
    return floor(abs(scale.counts_per_unit) * length)


def _scale(spot: Spot) -> Scale | None:
    scales = spot.scales()
    try:
        return scales.of(POSITION, scales.unit_of(POSITION))
    except UnknownScaleError:
        return None


def _missed(
    spot: Spot,
    what: str,
    targets: tuple[int, ...],
    position: int,
    tolerance: int,
    end: MotionEnd,
) -> TargetNotReachedError:
    target, scale = position + _miss(targets, position), _scale(spot)

    def shown(counts: int) -> str:
        if scale is None:
            return f"{counts} counts"
        return f"{float(scale.from_counts(counts)):.6g} {scale.unit}"

    states = [] if end.values is None else list(spot.connection.unit.hindered(end.values.message))
    why = [state.cause for state in states]
    if _shows_motion(spot, end.values):
        why.append("its status still shows motion")
    text = (
        f"{what} ended at {shown(position)}, {shown(abs(target - position))} from its target, "
        f"{shown(target)} (tolerance {shown(tolerance)})"
    )
    return TargetNotReachedError(
        f"{text}: {'; '.join(why)}" if why else text,
        target=target,
        position=position,
        tolerance=tolerance,
        unit="" if scale is None else scale.unit,
        target_in_units=None if scale is None else float(scale.from_counts(target)),
        position_in_units=None if scale is None else float(scale.from_counts(position)),
        limits=tuple(state.name for state in states if state.limit),
        end=end,
    )

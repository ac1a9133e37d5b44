"""What makes the checks that move an axis: what they need, and what stands in their way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from stagewire_conformance.device.check import Check, Need
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.making import axis_check
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.permissions import Permissions, RangeError
from stagewire_conformance.device.places import Target

__all__ = ["MOVES", "lacks_of", "motion_check", "motion_checks"]

MOVES: Final = (
    "WRITE_TARGET_POSITION", "READ_TARGET_POSITION", "READ_MOTOR_POSITION", "READ_STATUS",
    "READ_MOTOR_POSITION_AND_STATUS", "READ_CURRENT_SPEED", "READ_MAXIMUM_SPEED",
    "READ_RAMP_TIME",
)  # fmt: skip
"""What every check needs that moves an axis, watches it, and brings it back."""


def motion_check(
    kind: str,
    declared: Declared,
    allowed: Permissions,
    place: Target,
    look: Callable[[Mover], None],
    *,
    messages: tuple[str, ...] = (),
    settings: bool = False,
    lacks: str = "",
    **more: Any,
) -> Check:
    """Make a check that moves an axis.

    :param look: does what the check does.
    :param messages: what it covers beside :data:`MOVES`.
    :param settings: whether it changes settings, too.
    :param lacks: why what was allowed is not enough, beside :func:`lacks_of`.

    All others: see :func:`.axis_check`, and :class:`.Check`.
    """

    def move(axis: Axis) -> None:
        look(Mover(axis.trial, axis.place))

    return axis_check(
        kind,
        place,
        move,
        messages=tuple(dict.fromkeys((*messages, *MOVES))),
        needs=frozenset({Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION}),
        does=f"moves every axis within {allowed.motion}, and back to where it was",
        lacks=lacks_of(declared, allowed, place) or lacks,
        **more,
    )


def motion_checks(
    kind: str,
    declared: Declared,
    allowed: Permissions,
    look: Callable[[Mover], None],
    **more: Any,
) -> Iterator[Check]:
    """Make a check that moves an axis for each axis; see :func:`motion_check`."""
    for place in declared.places:
        yield motion_check(kind, declared, allowed, place, look, **more)


def lacks_of(declared: Declared, allowed: Permissions, place: Target) -> str:
    """Return why the range that was allowed says nothing of an axis; empty where it does."""
    try:
        if allowed.motion is not None:
            declared.reach(place, None, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""

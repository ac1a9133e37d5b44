"""The decorator that declares checks that move an axis: their needs, their effect, and what they lack."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, Final, TypeVar

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, every_axis
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions, RangeError
from stagewire_conformance.device.targets import Target

_Look = TypeVar("_Look", bound=Callable[..., None])

MOVES: Final = (
    "WRITE_TARGET_POSITION", "READ_TARGET_POSITION", "READ_MOTOR_POSITION", "READ_STATUS",
    "READ_MOTOR_POSITION_AND_STATUS", "READ_CURRENT_SPEED", "READ_MAXIMUM_SPEED",
    "READ_RAMP_TIME",
)  # fmt: skip
"""What every check needs that moves an axis, watches it, and brings it back."""


def motion_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...] = (),
    settings: bool = False,
    each: Callable[[Declaration, Permissions], Iterable[AxisCase]] = every_axis,
    **more: Any,
) -> Callable[[_Look], _Look]:
    """Declare a function that moves an axis as a check; a decorator.

    :param messages: what it covers besides :data:`MOVES`.
    :param settings: whether it also changes settings.

    All others: see :func:`.axis_check`.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
        for case in each(declared, allowed):
            yield replace(case, lacks=lacks_of(declared, allowed, case.place) or case.lacks)

    def declare(look: _Look) -> _Look:
        def move(axis: Axis, **arguments: object) -> None:
            look(Mover(axis.trial, axis.place), **arguments)

        axis_check(
            kind,
            title,
            messages=tuple(dict.fromkeys((*messages, *MOVES))),
            needs={Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION},
            does="moves every axis within {range}, and back to where it was",
            each=cases,
            **more,
        )(move)
        return look

    return declare


def lacks_of(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return why the range that was allowed says nothing of an axis; empty where it does."""
    try:
        if allowed.motion is not None:
            declared.reach(place, None, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""

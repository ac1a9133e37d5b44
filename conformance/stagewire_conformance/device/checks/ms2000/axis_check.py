"""The decorator that declares checks of an axis, and the axes and requests that they use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

from stagewire.protocols import Command
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial

_Look = TypeVar("_Look", bound=Callable[..., None])

SETTINGS_READ: Final = ("READ_INCREMENT_VALUE", "READ_RAMP_TIME", "READ_MAXIMUM_SPEED")
"""Requests for a setting, which changes only when it is written."""


@dataclass(frozen=True, kw_only=True)
class AxisCase(Case):
    """A case at one axis, which is ``{axis}`` in the title."""

    place: Target


def every_axis(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    """Yield a case for each axis."""
    for place in declared.places:
        yield AxisCase(place=place)


def axis_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...] = (),
    each: Callable[[Declaration, Permissions], Iterable[AxisCase]] = every_axis,
    **more: Any,
) -> Callable[[_Look], _Look]:
    """Declare a function as a check of an axis; a decorator.

    The function gets the axis, and the arguments of its case by keyword. A check is skipped if the PICS
    withdraws one of its messages. For other parameters, see :meth:`.Kind.check`.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
        for case in each(declared, allowed):
            place = case.place
            used = (*messages, *case.messages)
            yield replace(
                case,
                name="/".join(filter(None, (place.name, case.name))),
                words={"axis": f"axis {place.name}", **case.words},
                arguments={"place": place, **case.arguments},
                skip=place.why_none(used) or case.skip,
            )

    def declare(look: _Look) -> _Look:
        def run(trial: Trial, place: Target, **arguments: object) -> None:
            look(Axis(trial, place), **arguments)

        kind.check(title, messages=messages, each=cases, **more)(run)
        return look

    return declare


def first_place(declared: Declaration, *messages: str) -> Target:
    """Return the first axis that claims some messages; the first axis if none does."""
    claiming = (each for each in declared.places if not set(messages) - each.messages)
    return next(claiming, declared.places[0])


def requests_of(declared: Declaration) -> dict[str, Command]:
    """Return every command with a reply, by name, except those that must not be used."""
    found: dict[str, Command] = {}
    for cls in declared.protocol.messages:
        if issubclass(cls, Command) and cls.reply is not None and not cls.layout.dummy:
            found[cls.layout.message] = cls()
    return found

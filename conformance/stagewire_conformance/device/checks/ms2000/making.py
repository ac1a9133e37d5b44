"""What makes the checks of one axis: their id, and why one is skipped."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from stagewire.protocols import Command
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.places import Target

__all__ = ["SETTINGS_READ", "axis_check", "first_place", "requests_of"]

SETTINGS_READ: Final = ("READ_INCREMENT_VALUE", "READ_RAMP_TIME", "READ_MAXIMUM_SPEED")
"""What tells a setting, which stays as it is until it is written."""


def axis_check(
    kind: str,
    place: Target,
    look: Callable[[Axis], None],
    *,
    title: str,
    messages: tuple[str, ...],
    behind: str = "",
    undeclared: str = "",
    **more: Any,
) -> Check:
    """Make a check of one axis.

    :param kind: the name of its kind.
    :param look: does what the check does.
    :param title: with ``{axis}`` where the axis is named.
    :param messages: what it covers; it is skipped if the PICS takes back one of them.
    :param behind: what follows in the id behind the axis.
    :param undeclared: what the PICS does not declare beside, so that it is skipped.
    """
    return Check(
        id="/".join(filter(None, (kind, place.name, behind))),
        title=title.format(axis=f"axis {place.name}"),
        messages=messages,
        run=lambda trial: look(Axis(trial, place)),
        skip=next(filter(None, map(place.why_not, messages)), undeclared),
        **more,
    )


def first_place(declared: Declared, *messages: str) -> Target:
    """Return the first axis that claims some messages; of none the first axis."""
    claiming = (each for each in declared.places if not set(messages) - each.messages)
    return next(claiming, declared.places[0])


def requests_of(declared: Declared) -> dict[str, Command]:
    """Return every command that is answered, by its name; those are left out that are not to be used."""
    found: dict[str, Command] = {}
    for cls in declared.protocol.messages:
        if issubclass(cls, Command) and cls.reply is not None and not cls.layout.dummy:
            found[cls.layout.message] = cls()
    return found

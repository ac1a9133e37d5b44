"""The travel of a stage, within which targets have to lie.

The documents give no travel; it is the user's to give, and unknown until then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

from stagewire.devices.scales import Scales
from stagewire.devices.tables import Given
from stagewire.errors import BadValueError, LimitError, UnknownScaleError
from stagewire.quantities import Number, exact

__all__ = [
    "POSITION",
    "Travel",
    "check_fields",
    "check_measurable",
    "in_mm",
    "mm_of",
    "parse_travel",
]

POSITION: Final = "position"
"""The quantity that a travel limits."""

_PER_MM: Final = {"mm": 1, "um": 1000}
"""The units in which places are measured."""


@dataclass(frozen=True, slots=True)
class Travel:
    """Where a stage can go, in mm.

    :param low: the least position.
    :param high: the greatest position.
    """

    low: Fraction
    high: Fraction

    def __contains__(self, place: Fraction) -> bool:
        return self.low <= place <= self.high

    def check_place(self, what: str, place: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a place outside."""
        if place not in self:
            raise LimitError(
                f"{what}: {float(place):.10g} mm is outside the travel, {self}; nothing was sent"
            )

    def check_distance(self, what: str, distance: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a distance longer than the travel."""
        if abs(distance) > self.high - self.low:
            raise LimitError(
                f"{what}: {float(distance):.10g} mm is more than the travel, {self}; nothing was sent"
            )

    def __str__(self) -> str:
        return f"{float(self.low):.10g} to {float(self.high):.10g} mm"


def in_mm(value: Fraction, unit: str) -> Fraction:
    """Return a place or a distance in mm.

    Raises :class:`~stagewire.errors.UnknownScaleError` for a unit that measures none.
    """
    if unit not in _PER_MM:
        raise UnknownScaleError(f"a travel is in mm, which {unit} cannot be compared with")
    return value / _PER_MM[unit]


def check_measurable(unit: str, quantities: tuple[str, ...], scales: Scales) -> None:
    """Make sure that positions can be held against a travel, before there is one to hold against it.

    :param unit: for people.
    :param quantities: that its messages carry.

    Raises :class:`~stagewire.errors.UnknownScaleError` where there are none, or none in mm.
    """
    if POSITION not in quantities:
        raise UnknownScaleError(
            f"travel_mm limits positions, and a {unit} has none in mm; leave it out"
        )
    measure = scales.unit_of(POSITION)
    try:
        in_mm(scales.of(POSITION, measure).from_counts(0), measure)
    except UnknownScaleError as error:
        raise UnknownScaleError(f"travel_mm would limit nothing: {error}") from None


def mm_of(entry: Given, counts: int, scales: Scales) -> Fraction:
    """Return what a caller gave as a place or a distance, in mm."""
    _, unit, case = entry.ways[0]
    return in_mm(scales.of(entry.quantity, unit, case).from_counts(counts), unit)


def check_fields(
    travel: Travel, what: str, entries: tuple[Given, ...], fields: Mapping[str, Any], scales: Scales
) -> None:
    """Hold what is about to be sent or stored against the travel.

    Raises :class:`~stagewire.errors.LimitError`.
    """
    for entry in entries:
        if entry.target is not None and entry.field in fields:
            check = travel.check_place if entry.target == "absolute" else travel.check_distance
            check(f"{what}: {entry.field}", mm_of(entry, fields[entry.field], scales))


def parse_travel(travel: Number | tuple[Number, Number]) -> Travel:
    """Return a travel from its length, counted from 0, or from both ends.

    Raises :class:`~stagewire.errors.BadValueError` for what is none.
    """
    ends = travel if isinstance(travel, tuple | list) else (0, travel)
    if len(ends) != 2:
        raise BadValueError(f"travel_mm takes a length or (low, high) in mm, not {travel!r}")
    try:
        low, high = (exact(end) for end in ends)
    except BadValueError as error:
        raise BadValueError(f"travel_mm takes a length or (low, high) in mm: {error}") from None
    if not low < high:
        raise BadValueError(
            f"travel_mm: from {float(low):.10g} to {float(high):.10g} mm there is no travel"
        )
    return Travel(low, high)

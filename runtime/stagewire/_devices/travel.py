"""The travel of a stage: its length or its ends, in mm or degrees, and the limits of its controller."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from stagewire.errors import BadValueError, LimitError, UnknownScaleError
from stagewire.quantities import Number, Scale, exact

__all__ = ["MEASURES", "PER_MM", "POSITION", "TRAVELS", "Held", "Travel", "parse_travel"]

POSITION: Final = "position"
"""The quantity that a travel limits."""

TRAVELS: Final = {"mm": "travel_mm", "deg": "travel_deg"}
"""Unit of a travel, on linear and on rotary stages -> keyword of ``open`` that sets it."""

PER_MM: Final = {"mm": 1, "um": 1000}
"""Unit of length -> how many of it make 1 mm."""

MEASURES: Final = {
    unit + per: (base + per, factor)
    for base, units in (("mm", PER_MM), ("deg", {"deg": 1}))
    for unit, factor in units.items()
    for per in ("", "/s", "/s^2")
}
"""Unit -> the same unit with mm or deg, in which limits are given, and the factor between them."""

_BEYOND_ENDS: Final = Fraction(101, 100)
"""Allowance for moves along the whole travel: a stage stops a few counts before or after its ends."""

_HIGHEST: Final = 2**31 - 1
"""The highest position of a position counter."""


@dataclass(frozen=True, slots=True)
class Travel:
    """The travel of a stage.

    :param length: from one end to the other.
    :param low: lowest position; None if the zero position of the controller is unknown.
    :param source: origin of the values, for messages.
    :param stated: whether the user stated them.
    :param unit: ``mm``, or ``deg`` for a rotary stage.
    """

    length: Fraction
    low: Fraction | None
    source: str
    stated: bool = True
    unit: str = "mm"

    def holds(self, counts: int, scale: Scale) -> bool:
        """Return whether a position is within the ends of the travel, as far as they are known.

        All values are compared in counts, so a target at an end is within the travel although its counts are
        rounded.
        """
        if self.low is None:
            return True
        return (
            self._counts(self.low, scale) <= counts <= self._counts(self.low + self.length, scale)
        )

    def check_place(self, what: str, counts: int, scale: Scale) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a position outside the ends of the travel."""
        if not self.holds(counts, scale):
            raise LimitError(
                f"{what}: {self.shown(counts, scale)} is outside the travel, {self}; nothing was sent"
            )

    def check_distance(self, what: str, counts: int, scale: Scale) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a distance longer than the travel."""
        if abs(counts) > self._counts(self.length, scale):
            raise LimitError(
                f"{what}: {self.shown(counts, scale)} is longer than the travel, {self}; nothing was sent"
            )

    def check_way(self, what: str, here: int, counts: int, scale: Scale) -> None:
        """Raise :class:`~stagewire.errors.LimitError` if the way from ``here`` is longer than the travel."""
        if abs(counts - here) > self._counts(self.length * _BEYOND_ENDS, scale):
            raise LimitError(
                f"{what}: the way from {self.shown(here, scale)} to {self.shown(counts, scale)} is "
                f"longer than the travel, {self}; nothing was sent. If the position is wrong, home the "
                f"stage; if the travel is wrong, pass {TRAVELS[self.unit]}= to open"
            )

    def shown(self, counts: int, scale: Scale) -> str:
        """Return counts in the unit of the travel, for messages."""
        return f"{self.number(counts, scale):.10g} {self.unit}"

    def number(self, counts: int, scale: Scale) -> float:
        """Return counts as a number in the unit of the travel, for messages."""
        return float(scale.from_counts(counts) / _factor(scale))

    def _counts(self, value: Fraction, scale: Scale) -> int:
        return scale.to_counts(value * _factor(scale))

    def __str__(self) -> str:
        if self.low is None:
            return f"{float(self.length):.10g} {self.unit} ({self.source})"
        return f"{float(self.low):.10g} to {float(self.low + self.length):.10g} {self.unit}"


@dataclass(frozen=True, slots=True)
class Held:
    """Positions between which a controller keeps its stage.

    :param low: lowest position in counts.
    :param high: highest position in counts.
    :param source: message that reported them, for messages.
    :param chosen: whether they are software limits, positions of the counter that a user has switched on. The
        others are data of the stage, and positions of the counter after homing.
    """

    low: int
    high: int
    source: str
    chosen: bool

    @classmethod
    def between(cls, ends: Iterable[int], source: str, *, chosen: bool) -> Held | None:
        """Return the limits between two ends; None if they are not two different positions."""
        positions = sorted(set(ends))
        if len(positions) != 2:
            return None
        low, high = positions
        return cls(low, high, source, chosen) if low >= -_HIGHEST - 1 and high <= _HIGHEST else None

    def check_place(self, what: str, counts: int, scale: Scale | None) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a position outside."""
        if not self.low <= counts <= self.high:
            unit = "counts" if scale is None else scale.unit
            raise LimitError(
                f"{what}: {_number(counts, scale)} {unit} is outside the limits of the controller, "
                f"{self.shown(scale)}; nothing was sent{self._advice(scale)}"
            )

    def _advice(self, scale: Scale | None) -> str:
        """Return what to do if the position counter was changed after homing."""
        if self.chosen or scale is None:
            return ""
        option = TRAVELS[MEASURES[scale.unit][0]]
        return f". If the position counter was changed after homing, home again, or pass {option}= to open"

    def shown(self, scale: Scale | None) -> str:
        """Return the limits in units, or in counts without a scale, with their source."""
        unit = "counts" if scale is None else scale.unit
        when = "" if self.chosen else " after homing"
        return f"{_number(self.low, scale)} to {_number(self.high, scale)} {unit}{when} ({self.source})"


def _number(counts: int, scale: Scale | None) -> str:
    return str(counts) if scale is None else f"{float(scale.from_counts(counts)):.6g}"


def _factor(scale: Scale) -> int:
    """Return how many units of a scale make 1 mm or 1 degree.

    Raise :class:`~stagewire.errors.UnknownScaleError` for a unit that is not a length or an angle.
    """
    if scale.unit not in MEASURES:
        raise UnknownScaleError(f"a position in {scale.unit} cannot be compared with a travel")
    return MEASURES[scale.unit][1]


def parse_travel(travel: Number | tuple[Number, Number], unit: str) -> Travel:
    """Return a travel, given its length from 0 or its two ends.

    :param unit: ``mm`` or ``deg``.

    Raise :class:`~stagewire.errors.BadValueError` for anything else.
    """
    option = TRAVELS[unit]
    wanted = f"{option} must be a length or (low, high) in {unit}"
    ends = travel if isinstance(travel, tuple | list) else (0, travel)
    if len(ends) != 2:
        raise BadValueError(f"{wanted}, not {travel!r}")
    try:
        low, high = (exact(end) for end in ends)
    except BadValueError as error:
        raise BadValueError(f"{wanted}: {error}") from None
    if not low < high:
        raise BadValueError(
            f"{option}: the low end, {float(low):.10g} {unit}, must be below the high end, "
            f"{float(high):.10g} {unit}"
        )
    return Travel(high - low, low, f"set by {option}", unit=unit)

"""The limits of a stage: its travel, its maximum velocity and its maximum acceleration.

A limit comes from the user, or else from the stage in the registry, and records its source. Unknown limits
are not checked. If a limit of the user cannot be checked because positions or velocities have no scale,
opening fails; a user's limit is never ignored silently.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Final

from stagewire._devices.scales import Scales
from stagewire._devices.tables import Given
from stagewire.errors import BadValueError, LimitError, UnknownScaleError
from stagewire.quantities import Limit, Number, Stage, UnknownLimit, exact

__all__ = [
    "CEILINGS",
    "PER_MM",
    "POSITION",
    "Ceiling",
    "Limits",
    "Travel",
    "in_mm",
    "limits_of",
    "mm_of",
    "parse_travel",
]

POSITION: Final = "position"
"""The quantity that a travel limits."""

PER_MM: Final = {"mm": 1, "um": 1000}
"""Unit of length -> how many of it make 1 mm."""

CEILINGS: Final = {
    "max_velocity": ("maximum velocity", "max_velocity_mm_per_s", "mm/s"),
    "max_acceleration": ("maximum acceleration", "max_acceleration_mm_per_s2", "mm/s^2"),
}
"""The other limits of a stage: name -> title for messages, keyword of ``open``, and unit."""

_MEASURES: Final = {
    unit + per: ("mm" + per, factor)
    for unit, factor in PER_MM.items()
    for per in ("", "/s", "/s^2")
}
"""Unit -> the same unit with mm, and the factor between them."""

_BEYOND_ENDS: Final = Fraction(101, 100)
"""Allowance for moves along the whole travel: a stage stops a few counts before or after its ends."""


@dataclass(frozen=True, slots=True)
class Travel:
    """The travel of a stage, in mm.

    :param length: from one end to the other.
    :param low: lowest position; None if the zero position of the controller is unknown.
    :param source: origin of the values, for messages.
    :param stated: whether the user stated them.
    """

    length: Fraction
    low: Fraction | None
    source: str
    stated: bool = True

    def __contains__(self, place: Fraction) -> bool:
        return self.low is None or self.low <= place <= self.low + self.length

    def check_place(self, what: str, place: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a position outside the ends of the travel."""
        if place not in self:
            raise LimitError(
                f"{what}: {float(place):.10g} mm is outside the travel, {self}; nothing was sent"
            )

    def check_distance(self, what: str, distance: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a distance longer than the travel."""
        if abs(distance) > self.length:
            raise LimitError(
                f"{what}: {float(distance):.10g} mm is longer than the travel, {self}; nothing was sent"
            )

    def check_way(self, what: str, here: Fraction, place: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` if the way from ``here`` is longer than the travel."""
        if abs(place - here) > self.length * _BEYOND_ENDS:
            raise LimitError(
                f"{what}: the way from {float(here):.10g} mm to {float(place):.10g} mm is longer than the "
                f"travel, {self}; nothing was sent. If the position is wrong, home the stage; if the travel "
                "is wrong, pass travel_mm= to open"
            )

    def __str__(self) -> str:
        if self.low is None:
            return f"{float(self.length):.10g} mm ({self.source})"
        return f"{float(self.low):.10g} to {float(self.low + self.length):.10g} mm"


@dataclass(frozen=True, slots=True)
class Ceiling:
    """The maximum velocity or acceleration of a stage.

    :param title: name in messages.
    :param option: keyword of ``open`` that replaces it.
    :param unit: ``mm/s`` or ``mm/s^2``.
    :param value: in this unit.
    :param source: as in :class:`Travel`.
    :param stated: as in :class:`Travel`.
    """

    title: str
    option: str
    unit: str
    value: Fraction
    source: str
    stated: bool = True

    def check(self, what: str, entry: Given, counts: int, scales: Scales) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for counts that exceed it.

        If the scale is unknown, a limit of the registry is not checked, and a limit of the user raises
        :class:`~stagewire.errors.UnknownScaleError`.
        """
        _, unit, case = entry.ways[0]
        try:
            scale = scales.of(entry.quantity, unit, case)
        except UnknownScaleError as error:
            if not self.stated:
                return
            raise UnknownScaleError(f"{what} cannot be compared with the {self}: {error}") from None
        # Both are rounded the same way, so the limit itself is always accepted.
        if abs(counts) > scale.to_counts(self.value * _MEASURES[unit][1]):
            number = scale.from_counts(counts)
            raise LimitError(
                f"{what}: {float(number):.6g} {unit} ({counts} counts) exceeds the {self}; nothing was sent. "
                f"To allow more, pass {self.option}= to open"
            )

    def __str__(self) -> str:
        return f"{self.title}, {float(self.value):.10g} {self.unit} ({self.source})"


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of the stage on one channel.

    :param travel: None if unknown.
    :param ceilings: name in :data:`CEILINGS` -> limit, without unknown limits.
    :param reasons: name -> why the limit is unknown, if the registry gives a reason.
    """

    travel: Travel | None
    ceilings: Mapping[str, Ceiling]
    reasons: Mapping[str, str]

    def check_measurable(
        self, unit: str, settable: tuple[str, ...], scales: Scales, *, has_status: bool
    ) -> None:
        """Check that each limit of the user can be compared with some value.

        :param unit: name of the unit, for messages.
        :param settable: quantities in its messages to the controller.
        :param has_status: whether the controller can be asked for its position.

        Raise :class:`~stagewire.errors.UnknownScaleError`.
        """
        if self.travel is not None and self.travel.stated:
            if POSITION not in settable:
                raise UnknownScaleError(
                    f"travel_mm limits positions, but a {unit} has no positions in mm; leave it out"
                )
            if why := _unmeasurable(POSITION, scales):
                raise UnknownScaleError(f"travel_mm cannot be checked: {why}")
            if self.travel.low is None and not has_status:
                raise UnknownScaleError(
                    f"the length of the travel cannot be checked, because a {unit} does not report its "
                    "position; pass both ends to open instead: travel_mm=(low, high)"
                )
        for ceiling in self.ceilings.values():
            limited = _limited(ceiling.unit, settable, scales)
            reasons = [_unmeasurable(quantity, scales) for quantity in limited]
            if ceiling.stated and all(reasons):
                why = reasons[0] if reasons else f"a {unit} has no values in {ceiling.unit}"
                raise UnknownScaleError(f"{ceiling.option} cannot be checked: {why}")

    def now(self, scales: Scales) -> Limits:
        """Return the limits that can be checked with these scales."""
        travel = self.travel
        if travel is None or travel.stated or not _unmeasurable(POSITION, scales):
            return self
        return replace(self, travel=None)

    def check(
        self, what: str, entries: tuple[Given, ...], fields: Mapping[str, Any], scales: Scales
    ) -> None:
        """Check values before they are sent or stored.

        Raise :class:`~stagewire.errors.LimitError`.
        """
        for entry in entries:
            if entry.field not in fields or not entry.ways:
                continue
            name, counts = f"{what}: {entry.field}", fields[entry.field]
            if entry.target is not None and self.travel is not None:
                absolute = entry.target == "absolute"
                check = self.travel.check_place if absolute else self.travel.check_distance
                check(name, mm_of(entry, counts, scales))
            measure = _MEASURES.get(entry.ways[0][1], ("", 1))[0]
            for ceiling in self.ceilings.values():
                if ceiling.unit == measure:
                    ceiling.check(name, entry, counts, scales)

    # For people

    def described(self, settable: tuple[str, ...], scales: Scales) -> Iterator[str]:
        """Yield a line for each limit that applies: its value and source, or that it is not checked."""
        if POSITION in settable:
            why = _unmeasurable(POSITION, scales)
            if self.travel is None:
                yield self._unknown("travel", "travel", "travel_mm", can_be_given=not why)
            elif self.travel.low is None:
                yield f"travel: {self.travel}{f'; not checked: {why}' if why else ''}"
            else:
                yield f"travel: {self.travel} ({self.travel.source})"
        for name, (title, option, unit) in CEILINGS.items():
            limited = _limited(unit, settable, scales)
            if not limited:
                continue
            unchecked = [quantity for quantity in limited if _unmeasurable(quantity, scales)]
            ceiling = self.ceilings.get(name)
            if ceiling is None:
                yield self._unknown(name, title, option, can_be_given=unchecked != limited)
                continue
            line = f"{title}: {float(ceiling.value):.10g} {unit} ({ceiling.source})"
            if unchecked:
                line += f"; {', '.join(unchecked)} not checked: scale unknown"
            yield line

    def _unknown(self, name: str, title: str, option: str, *, can_be_given: bool) -> str:
        reason = self.reasons.get(name)
        because = f" ({reason})" if reason else ""
        advice = f"set it with {option}=" if can_be_given else "cannot be set: scale unknown"
        return f"{title}: unknown{because}; not checked; {advice}"


def limits_of(
    stage: Stage | None, travel: Travel | None, ceilings: Mapping[str, Fraction]
) -> Limits:
    """Return the limits of one channel: those of the user, or else those of its stage.

    :param ceilings: limits of the user, by name in :data:`CEILINGS`.
    """
    own = {} if stage is None else stage.limits
    stated = stage is not None and stage.by_user
    known = {
        name: Ceiling(
            *CEILINGS[name], value=limit.value, source=_source(stage, limit), stated=stated
        )
        for name, limit in own.items()
        if name in CEILINGS and isinstance(limit, Limit)
    }
    known |= {
        name: Ceiling(*CEILINGS[name], value=value, source=f"set by {CEILINGS[name][1]}")
        for name, value in ceilings.items()
    }
    length = own.get("travel")
    if travel is None and isinstance(length, Limit):
        travel = Travel(length.value, None, _source(stage, length), stated)
    reasons = {name: limit.reason for name, limit in own.items() if isinstance(limit, UnknownLimit)}
    return Limits(travel, known, reasons)


def _source(stage: Stage | None, limit: Limit) -> str:
    assert stage is not None  # it has the limit
    return f"{stage.name}, {limit.source}"


def in_mm(value: Fraction, unit: str) -> Fraction:
    """Return a position or a distance in mm.

    Raise :class:`~stagewire.errors.UnknownScaleError` for a unit that is not a length.
    """
    if unit not in PER_MM:
        raise UnknownScaleError(f"a position in {unit} cannot be compared with a travel in mm")
    return value / PER_MM[unit]


def check_measurable(
    option: str, unit: str, quantities: tuple[str, ...], channels: Iterable[Scales]
) -> None:
    """Check that positions on some channel can be compared with a length of the user.

    :param option: keyword that gives the length.
    :param unit: name of the unit, for messages.
    :param quantities: quantities in its messages.

    Raise :class:`~stagewire.errors.UnknownScaleError`.
    """
    if POSITION not in quantities:
        raise UnknownScaleError(
            f"{option} limits positions, but a {unit} has no positions in mm; leave it out"
        )
    reasons = [_unmeasurable(POSITION, scales) for scales in channels]
    if all(reasons):
        raise UnknownScaleError(f"{option} cannot be checked: {reasons[0]}")


def mm_of(entry: Given, counts: int, scales: Scales) -> Fraction:
    """Return a position or a distance in counts as mm."""
    _, unit, case = entry.ways[0]
    return in_mm(scales.of(entry.quantity, unit, case).from_counts(counts), unit)


def _limited(unit: str, settable: Iterable[str], scales: Scales) -> list[str]:
    """Return the quantities whose values are compared with a limit in ``unit``."""
    measures = {quantity: _MEASURES.get(scales.unit_of(quantity)) for quantity in settable}
    return [quantity for quantity, measure in measures.items() if measure and measure[0] == unit]


def _unmeasurable(quantity: str, scales: Scales) -> str:
    """Return why counts of a quantity cannot be compared with a limit; empty if they can."""
    unit = scales.unit_of(quantity)
    if unit not in _MEASURES:
        return f"values in {unit} cannot be compared with a limit in mm"
    try:
        scales.of(quantity, unit)
    except UnknownScaleError as error:
        return str(error)
    return ""


def parse_travel(travel: Number | tuple[Number, Number]) -> Travel:
    """Return a travel, given its length from 0 or its two ends.

    Raise :class:`~stagewire.errors.BadValueError` for anything else.
    """
    ends = travel if isinstance(travel, tuple | list) else (0, travel)
    if len(ends) != 2:
        raise BadValueError(f"travel_mm must be a length or (low, high) in mm, not {travel!r}")
    try:
        low, high = (exact(end) for end in ends)
    except BadValueError as error:
        raise BadValueError(f"travel_mm must be a length or (low, high) in mm: {error}") from None
    if not low < high:
        raise BadValueError(
            f"travel_mm: the low end, {float(low):.10g} mm, must be below the high end, {float(high):.10g} mm"
        )
    return Travel(high - low, low, "set by travel_mm")

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
from stagewire.quantities import EndlessTravel, Limit, Number, Stage, UnknownLimit, exact

__all__ = [
    "CEILINGS",
    "PER_MM",
    "POSITION",
    "Ceiling",
    "Limits",
    "Travel",
    "limits_of",
    "measured",
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
"""The other limits of a stage: name -> title for messages, keyword of ``open``, and unit.

The limits of a rotary stage are in degrees, and have no keyword.
"""

_MEASURES: Final = {
    unit + per: (base + per, factor)
    for base, units in (("mm", PER_MM), ("deg", {"deg": 1}))
    for unit, factor in units.items()
    for per in ("", "/s", "/s^2")
}
"""Unit -> the same unit with mm or deg, in which limits are given, and the factor between them."""

_BEYOND_ENDS: Final = Fraction(101, 100)
"""Allowance for moves along the whole travel: a stage stops a few counts before or after its ends."""


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

    def __contains__(self, place: Fraction) -> bool:
        return self.low is None or self.low <= place <= self.low + self.length

    def check_place(self, what: str, place: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a position outside the ends of the travel."""
        if place not in self:
            raise LimitError(
                f"{what}: {float(place):.10g} {self.unit} is outside the travel, {self}; nothing was sent"
            )

    def check_distance(self, what: str, distance: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a distance longer than the travel."""
        if abs(distance) > self.length:
            raise LimitError(
                f"{what}: {float(distance):.10g} {self.unit} is longer than the travel, "
                f"{self}; nothing was sent"
            )

    def check_way(self, what: str, here: Fraction, place: Fraction) -> None:
        """Raise :class:`~stagewire.errors.LimitError` if the way from ``here`` is longer than the travel."""
        if abs(place - here) > self.length * _BEYOND_ENDS:
            way = "travel_mm=" if self.unit == "mm" else "stage=Stage.of_user(...)"
            raise LimitError(
                f"{what}: the way from {float(here):.10g} {self.unit} to {float(place):.10g} {self.unit} is "
                f"longer than the travel, {self}; nothing was sent. If the position is wrong, home the "
                f"stage; if the travel is wrong, pass {way} to open"
            )

    def __str__(self) -> str:
        if self.low is None:
            return f"{float(self.length):.10g} {self.unit} ({self.source})"
        return f"{float(self.low):.10g} to {float(self.low + self.length):.10g} {self.unit}"


@dataclass(frozen=True, slots=True)
class Ceiling:
    """The maximum velocity or acceleration of a stage.

    :param title: name in messages.
    :param option: keyword of ``open`` that replaces it.
    :param unit: ``mm/s`` or ``mm/s^2``; for a rotary stage ``deg/s`` or ``deg/s^2``.
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
        unit, case = _way(entry, scales)
        try:
            scale = scales.of(entry.quantity, unit, case)
        except UnknownScaleError as error:
            if not self.stated:
                return
            raise UnknownScaleError(f"{what} cannot be compared with the {self}: {error}") from None
        # Both are rounded the same way, so the limit itself is always accepted.
        if abs(counts) > scale.to_counts(self.value * _MEASURES[unit][1]):
            number = scale.from_counts(counts)
            way = f"{self.option}=" if self.unit.startswith("mm") else "stage=Stage.of_user(...)"
            raise LimitError(
                f"{what}: {float(number):.6g} {unit} ({counts} counts) exceeds the {self}; nothing was sent. "
                f"To allow more, pass {way} to open"
            )

    def __str__(self) -> str:
        return f"{self.title}, {float(self.value):.10g} {self.unit} ({self.source})"


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of the stage on one channel.

    :param travel: None if unknown.
    :param ceilings: name in :data:`CEILINGS` -> limit, without unknown limits.
    :param reasons: name -> why the limit is unknown, if the registry gives a reason.
    :param endless: source of the fact that the stage has no ends; empty if it has, or if that is unknown.
    """

    travel: Travel | None
    ceilings: Mapping[str, Ceiling]
    reasons: Mapping[str, str]
    endless: str = ""

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
            if why := _unmeasurable(POSITION, scales, self.travel.unit):
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
                on = f" with {scales.stage}" if _is_rotary(scales) else ""
                why = reasons[0] if reasons else f"a {unit}{on} has no values in {ceiling.unit}"
                raise UnknownScaleError(f"{ceiling.option} cannot be checked: {why}")

    def now(self, scales: Scales) -> Limits:
        """Return the limits that can be checked with these scales."""
        travel = self.travel
        if travel is None or travel.stated or not _unmeasurable(POSITION, scales, travel.unit):
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
                check(name, _length_of(entry, counts, scales))
            measure = _MEASURES.get(_way(entry, scales)[0], ("", 1))[0]
            for ceiling in self.ceilings.values():
                if ceiling.unit == measure:
                    ceiling.check(name, entry, counts, scales)

    # For people

    def described(self, settable: tuple[str, ...], scales: Scales) -> Iterator[str]:
        """Yield a line for each limit that applies: its value and source, or that it is not checked."""
        if POSITION in settable:
            why = _unmeasurable(POSITION, scales)
            if self.travel is None and self.endless:
                yield f"travel: endless ({self.endless})"
            elif self.travel is None:
                advice = _advice("travel_mm", scales, known=not why)
                yield self._unknown("travel", "travel", advice)
            elif self.travel.low is None:
                yield f"travel: {self.travel}{f'; not checked: {why}' if why else ''}"
            else:
                yield f"travel: {self.travel} ({self.travel.source})"
        for name, (title, option, unit_in_mm) in CEILINGS.items():
            unit = unit_in_mm.replace("mm", "deg") if _is_rotary(scales) else unit_in_mm
            limited = _limited(unit, settable, scales)
            if not limited:
                continue
            unchecked = [quantity for quantity in limited if _unmeasurable(quantity, scales)]
            ceiling = self.ceilings.get(name)
            if ceiling is None:
                yield self._unknown(
                    name, title, _advice(option, scales, known=unchecked != limited)
                )
                continue
            line = f"{title}: {float(ceiling.value):.10g} {unit} ({ceiling.source})"
            if unchecked:
                line += f"; {', '.join(unchecked)} not checked: scale unknown"
            yield line

    def _unknown(self, name: str, title: str, advice: str) -> str:
        reason = self.reasons.get(name)
        because = f" ({reason})" if reason else ""
        return f"{title}: unknown{because}; not checked; {advice}"


def _advice(option: str, scales: Scales, *, known: bool) -> str:
    """Return how to set a limit, or why it cannot be set."""
    if _is_rotary(scales):
        return f"cannot be set: {option} does not apply to a rotary stage"
    return f"set it with {option}=" if known else "cannot be set: scale unknown"


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
            *CEILINGS[name][:2], limit.unit, limit.value, _source(stage, limit), stated=stated
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
        travel = Travel(length.value, None, _source(stage, length), stated, length.unit)
    reasons = {name: limit.reason for name, limit in own.items() if isinstance(limit, UnknownLimit)}
    endless = _source(stage, length) if isinstance(length, EndlessTravel) else ""
    return Limits(travel, known, reasons, endless)


def _source(stage: Stage | None, limit: Limit | EndlessTravel) -> str:
    assert stage is not None  # it has the limit
    return f"{stage.name}, {limit.source}"


def measured(value: Fraction, unit: str) -> Fraction:
    """Return a position or a distance in mm, or in degrees.

    Raise :class:`~stagewire.errors.UnknownScaleError` for a unit that is not a length or an angle.
    """
    if unit not in _MEASURES:
        raise UnknownScaleError(f"a position in {unit} cannot be compared with a travel in mm")
    return value / _MEASURES[unit][1]


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
    reasons = [_unmeasurable(POSITION, scales, "mm") for scales in channels]
    if all(reasons):
        raise UnknownScaleError(f"{option} cannot be checked: {reasons[0]}")


def _way(entry: Given, scales: Scales) -> tuple[str, str | None]:
    """Return the unit in which an argument is compared with limits, and its case."""
    _, unit, case = entry.ways[0]
    return scales.unit_of(entry.quantity) or unit, case


def _length_of(entry: Given, counts: int, scales: Scales) -> Fraction:
    """Return a position or a distance in counts as mm or degrees."""
    unit, case = _way(entry, scales)
    return measured(scales.of(entry.quantity, unit, case).from_counts(counts), unit)


def _is_rotary(scales: Scales) -> bool:
    return scales.stage is not None and scales.stage.rotary


def _limited(unit: str, settable: Iterable[str], scales: Scales) -> list[str]:
    """Return the quantities whose values are compared with a limit in ``unit``."""
    measures = {quantity: _MEASURES.get(scales.unit_of(quantity)) for quantity in settable}
    return [quantity for quantity, measure in measures.items() if measure and measure[0] == unit]


def _unmeasurable(quantity: str, scales: Scales, wanted: str = "") -> str:
    """Return why counts of a quantity cannot be compared with a limit; empty if they can.

    :param wanted: unit of the limit; empty for the limits of the stage itself.
    """
    unit = scales.unit_of(quantity)
    measure, _ = _MEASURES.get(unit, ("", 1))
    if not measure or (wanted and measure != wanted):
        return f"values in {unit} cannot be compared with a limit in {wanted or 'mm'}"
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


# Names of 0.1, for one release
in_mm = measured
mm_of = _length_of

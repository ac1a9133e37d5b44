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
from stagewire._devices.travel import MEASURES, PER_MM, POSITION, TRAVELS, Held, Travel
from stagewire.errors import LimitError, UnknownScaleError
from stagewire.quantities import EndlessTravel, Limit, Scale, Stage, UnknownLimit

__all__ = [
    "CEILINGS",
    "Ceiling",
    "Limits",
    "ceiling_of",
    "check_kind",
    "check_measurable",
    "limits_of",
]

CEILINGS: Final = {
    "max_velocity": (
        "maximum velocity",
        {"mm/s": "max_velocity_mm_per_s", "deg/s": "max_velocity_deg_per_s"},
    ),
    "max_acceleration": (
        "maximum acceleration",
        {"mm/s^2": "max_acceleration_mm_per_s2", "deg/s^2": "max_acceleration_deg_per_s2"},
    ),
}
"""The other limits of a stage: name -> title for messages, and the keyword of ``open`` by unit."""


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
        if abs(counts) > scale.to_counts(self.value * MEASURES[unit][1]):
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
    :param endless: source of the fact that the stage has no ends; empty if it has, or if that is unknown.
    :param held: limits that the controller reported.
    """

    travel: Travel | None
    ceilings: Mapping[str, Ceiling]
    reasons: Mapping[str, str]
    endless: str = ""
    held: tuple[Held, ...] = ()

    def holding(self, held: Iterable[Held]) -> Limits:
        """Return the limits with those of the controller.

        Its data of the stage do not apply if the user stated the ends, or if the stage has none.
        """
        own = self.endless or (self.travel is not None and self.travel.low is not None)
        return replace(self, held=tuple(one for one in held if one.chosen or not own))

    @property
    def depend_on_homing(self) -> bool:
        """Whether some limits apply only after homing."""
        return not all(held.chosen for held in self.held)

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
            option = TRAVELS[self.travel.unit]
            if POSITION not in settable:
                raise UnknownScaleError(
                    f"{option} limits positions, but a {unit} has no positions in {self.travel.unit}; "
                    "leave it out"
                )
            check_kind(TRAVELS, self.travel.unit, scales)
            if why := _unmeasurable(POSITION, scales, self.travel.unit):
                raise UnknownScaleError(f"{option} cannot be checked: {why}")
            if self.travel.low is None and not has_status:
                raise UnknownScaleError(
                    f"the length of the travel cannot be checked, because a {unit} does not report its "
                    f"position; pass both ends to open instead: {option}=(low, high)"
                )
        for name, ceiling in self.ceilings.items():
            if ceiling.stated:
                check_kind(CEILINGS[name][1], ceiling.unit, scales)
            limited = _limited(ceiling.unit, settable, scales)
            reasons = [_unmeasurable(quantity, scales, ceiling.unit) for quantity in limited]
            if ceiling.stated and all(reasons):
                why = reasons[0] if reasons else f"a {unit} has no values in {ceiling.unit}"
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
            if entry.target == "absolute":
                self.check_held(name, (counts,), scales)
            if entry.target is not None and self.travel is not None:
                absolute = entry.target == "absolute"
                check = self.travel.check_place if absolute else self.travel.check_distance
                unit, case = _way(entry, scales)
                check(name, counts, scales.of(entry.quantity, unit, case))
            measure = MEASURES.get(_way(entry, scales)[0], ("", 1))[0]
            for ceiling in self.ceilings.values():
                if ceiling.unit == measure:
                    ceiling.check(name, entry, counts, scales)

    def check_held(
        self, what: str, targets: tuple[int, ...], scales: Scales, *, homed: bool = False
    ) -> None:
        """Check that the controller allows a target, or one of several.

        :param homed: whether the stage is homed.

        Raise :class:`~stagewire.errors.LimitError`.
        """
        for held in self.held:
            inside = any(held.low <= target <= held.high for target in targets)
            if not inside and (held.chosen or homed):
                held.check_place(what, targets[0], position_scale(scales))

    # For people

    def described(self, settable: tuple[str, ...], scales: Scales) -> Iterator[str]:
        """Yield a line for each limit that applies: its value and source, or that it is not checked."""
        if POSITION in settable:
            why = _unmeasurable(POSITION, scales)
            if self.travel is None and self.endless:
                yield f"travel: endless ({self.endless})"
            elif self.travel is None:
                advice = _advice(TRAVELS[_base(scales)], known=not why)
                yield self._unknown("travel", "travel", advice)
            elif self.travel.low is None:
                yield f"travel: {self.travel}{f'; not checked: {why}' if why else ''}"
            else:
                yield f"travel: {self.travel} ({self.travel.source})"
            for held in self.held:
                yield f"limits of the controller: {held.shown(position_scale(scales))}"
        for name, (title, options) in CEILINGS.items():
            [(unit, option)] = [(u, o) for u, o in options.items() if u.startswith(_base(scales))]
            limited = _limited(unit, settable, scales)
            if not limited:
                continue
            unchecked = [quantity for quantity in limited if _unmeasurable(quantity, scales)]
            ceiling = self.ceilings.get(name)
            if ceiling is None:
                yield self._unknown(name, title, _advice(option, known=unchecked != limited))
                continue
            line = f"{title}: {float(ceiling.value):.10g} {unit} ({ceiling.source})"
            if unchecked:
                line += f"; {', '.join(unchecked)} not checked: scale unknown"
            yield line

    def _unknown(self, name: str, title: str, advice: str) -> str:
        reason = self.reasons.get(name)
        because = f" ({reason})" if reason else ""
        return f"{title}: unknown{because}; not checked; {advice}"


def _advice(option: str, *, known: bool) -> str:
    """Return how to set a limit, or why it cannot be set."""
    return f"set it with {option}=" if known else "cannot be set: scale unknown"


def ceiling_of(limit: str, unit: str, value: Fraction) -> Ceiling:
    """Return a limit of the user.

    :param limit: name in :data:`CEILINGS`.
    """
    title, options = CEILINGS[limit]
    return Ceiling(title, options[unit], unit, value, f"set by {options[unit]}")


def limits_of(
    stage: Stage | None, travel: Travel | None, ceilings: Mapping[str, Ceiling]
) -> Limits:
    """Return the limits of one channel: those of the user, or else those of its stage.

    :param ceilings: limits of the user, by name in :data:`CEILINGS`.
    """
    own = {} if stage is None else stage.limits
    stated = stage is not None and stage.by_user
    known = {
        name: replace(
            ceiling_of(name, limit.unit, limit.value), source=_source(stage, limit), stated=stated
        )
        for name, limit in own.items()
        if name in CEILINGS and isinstance(limit, Limit)
    }
    known |= ceilings
    length = own.get("travel")
    if travel is None and isinstance(length, Limit):
        travel = Travel(length.value, None, _source(stage, length), stated, length.unit)
    reasons = {name: limit.reason for name, limit in own.items() if isinstance(limit, UnknownLimit)}
    endless = _source(stage, length) if isinstance(length, EndlessTravel) else ""
    return Limits(travel, known, reasons, endless)


def position_scale(scales: Scales) -> Scale | None:
    """Return the scale of the position; None if it is unknown."""
    try:
        return scales.of(POSITION, scales.unit_of(POSITION))
    except UnknownScaleError:
        return None


def _source(stage: Stage | None, limit: Limit | EndlessTravel) -> str:
    assert stage is not None  # it has the limit
    return f"{stage.name}, {limit.source}"


def check_kind(options: Mapping[str, str], unit: str, scales: Scales) -> None:
    """Raise an error for a limit of the user that is for stages of the other kind, rotary or linear.

    :param options: unit -> keyword that sets the limit.
    :param unit: unit of the limit.

    Raise :class:`~stagewire.errors.UnknownScaleError`.
    """
    if scales.stage is None or unit.startswith(_base(scales)):
        return
    [right] = [option for other, option in options.items() if other.startswith(_base(scales))]
    kind = "rotary" if scales.stage.rotary else "linear"
    raise UnknownScaleError(
        f"{options[unit]} does not apply to {scales.stage.name}, a {kind} stage; use {right}",
        instead=right,
    )


def check_measurable(
    options: Mapping[str, str],
    wanted: str,
    unit: str,
    quantities: tuple[str, ...],
    channels: Iterable[Scales],
) -> None:
    """Check that positions on some channel can be compared with a length or an angle of the user.

    :param options: unit -> keyword that gives it.
    :param wanted: its unit.
    :param unit: name of the unit, for messages.
    :param quantities: quantities in its messages.

    Raise :class:`~stagewire.errors.UnknownScaleError`.
    """
    if POSITION not in quantities:
        raise UnknownScaleError(
            f"{options[wanted]} limits positions, but a {unit} has no positions in {wanted}; "
            "leave it out"
        )
    there = list(channels)
    reasons = [_unmeasurable(POSITION, scales, wanted) for scales in there]
    if all(reasons):
        check_kind(options, wanted, there[0])
        raise UnknownScaleError(f"{options[wanted]} cannot be checked: {reasons[0]}")


def _way(entry: Given, scales: Scales) -> tuple[str, str | None]:
    """Return the unit in which an argument is compared with limits, and its case."""
    _, unit, case = entry.ways[0]
    return scales.unit_of(entry.quantity) or unit, case


def _base(scales: Scales) -> str:
    """Return the unit of positions in which limits are given."""
    return "deg" if scales.stage is not None and scales.stage.rotary else "mm"


def _limited(unit: str, settable: Iterable[str], scales: Scales) -> list[str]:
    """Return the quantities whose values are compared with a limit in ``unit``."""
    return [
        quantity
        for quantity in settable
        if any(MEASURES.get(own, ("",))[0] == unit for own in scales.units_of(quantity))
    ]


def _unmeasurable(quantity: str, scales: Scales, wanted: str = "") -> str:
    """Return why counts of a quantity cannot be compared with a limit; empty if they can.

    :param wanted: unit of the limit; empty for the limits of the stage itself.
    """
    units = {MEASURES[unit][0]: unit for unit in scales.units_of(quantity) if unit in MEASURES}
    if not units or (wanted and wanted not in units):
        unit = scales.unit_of(quantity)
        return f"values in {unit} cannot be compared with a limit in {wanted or 'mm'}"
    try:
        scales.of(quantity, units[wanted] if wanted else scales.unit_of(quantity))
    except UnknownScaleError as error:
        return str(error)
    return ""


# Names of 0.1, for one release


def in_mm(value: Fraction, unit: str) -> Fraction:
    """Return a position or a distance in mm."""
    return value / PER_MM[unit]


def mm_of(entry: Given, counts: int, scales: Scales) -> Fraction:
    """Return a position or a distance in counts as mm."""
    unit, case = _way(entry, scales)
    return in_mm(scales.of(entry.quantity, unit, case).from_counts(counts), unit)

"""Exact conversion between engineering units and the counts on the wire.

A scale is a rational number, never a float: ``Scale.counts_per("mm", 20000)`` or
``Scale.unit_per("us", 512, 5)``. Counts are rounded to the nearest integer. Ties are rounded away from zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import Final, NoReturn

from stagewire.errors import BadValueError, UnknownScaleError

__all__ = [
    "EndlessTravel",
    "Limit",
    "Number",
    "Scale",
    "ScaleConflict",
    "Stage",
    "UnknownLimit",
    "UnknownScale",
    "exact",
    "find_stages",
    "round_half_away",
]

Number = int | float | Decimal | Fraction | str


_BEYOND: Final = 10**60
_LONGEST: Final = 1000  # characters of a text, bits of an integer
_EXPONENT: Final = 3  # digits of an exponent


def exact(value: Number) -> Fraction:
    """Return ``value`` as a fraction.

    A float counts as the shortest decimal with the same repr, so 0.1 is exactly one tenth. Raise
    :class:`BadValueError` for NaN, infinity, a bool, text that is not a number, and numbers too large for any
    quantity: 10**60 or more, or an exponent with more than three digits.
    """
    if _is_vast(value):
        raise BadValueError("the number is too large for any range")
    if isinstance(value, bool):
        raise BadValueError(f"{value} is not a number")
    if isinstance(value, float):
        if not math.isfinite(value):
            raise BadValueError(f"{value} is not a finite number")
        value = repr(value)
    try:
        number = Fraction(value)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise BadValueError(f"{value!r} is not a number") from None
    if abs(number) >= _BEYOND:
        raise BadValueError("the number is too large for any range")
    return number


def _is_vast(value: object) -> bool:
    """Return whether a number has too many digits to convert.

    ``10**exponent`` is computed exactly, and a huge exponent would block every thread for minutes.
    """
    if isinstance(value, str):
        exponent = value.lower().partition("e")[2].strip().lstrip("+-")
        return len(value) > _LONGEST or len(exponent.lstrip("0")) > _EXPONENT
    if isinstance(value, Decimal) and value.is_finite():
        return len(str(abs(value.adjusted()))) > _EXPONENT
    return isinstance(value, int) and value.bit_length() > _LONGEST


def _ratio(numerator: Number, denominator: Number) -> Fraction:
    if (
        type(numerator) is type(denominator) is int and denominator
    ):  # of the registry, at each import
        return Fraction(numerator, denominator)
    over, under = exact(numerator), exact(denominator)
    if not under:
        raise BadValueError(f"a scale of {numerator} / {denominator} is not a number")
    return over / under


def round_half_away(value: Fraction) -> int:
    """Round to the nearest integer, and ties away from zero."""
    magnitude = math.floor(abs(value) + Fraction(1, 2))
    return magnitude if value >= 0 else -magnitude


@dataclass(frozen=True, slots=True, repr=False)
class Scale:
    """A scale: the number of counts on the wire in one engineering unit, as an exact fraction.

    :param counts_per_unit: counts in one ``unit``; positive.
    :param unit: engineering unit, such as ``mm/s``.
    :param printed: factor as printed in the document, possibly rounded; not used in conversions.
    :param source: origin of the factor if it is not from the document.

    Raises :class:`~stagewire.errors.BadValueError` for a factor that is not positive.
    """

    counts_per_unit: Fraction
    unit: str
    printed: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        """Raise :class:`~stagewire.errors.BadValueError` for a factor that is not positive."""
        if self.counts_per_unit <= 0:
            raise BadValueError(f"a scale must be positive, not {self.counts_per_unit}")

    @classmethod
    def counts_per(
        cls,
        unit: str,
        numerator: Number,
        denominator: Number = 1,
        printed: str = "",
        source: str = "",
    ) -> Scale:
        """Return the scale of ``numerator/denominator`` counts per unit.

        A float counts as the decimal that Python prints for it: ``34554.96`` is exactly 34554.96 counts.

        Raise :class:`~stagewire.errors.BadValueError` for a value that is not a number, and for a ratio that
        is not positive.
        """
        return cls(_ratio(numerator, denominator), unit, printed, source)

    @classmethod
    def unit_per(
        cls,
        unit: str,
        numerator: Number,
        denominator: Number = 1,
        printed: str = "",
        source: str = "",
    ) -> Scale:
        """Return the scale of ``numerator/denominator`` units per count, as :meth:`counts_per` does."""
        return cls(_ratio(denominator, numerator), unit, printed, source)

    def to_counts(self, value: Number) -> int:
        """Convert from units to counts: exact factor, nearest integer, ties away from zero.

        Raise :class:`~stagewire.errors.BadValueError` for a value that is not a number. The range of the
        field is checked later, when the message is created.
        """
        return round_half_away(exact(value) * self.counts_per_unit)

    def from_counts(self, counts: int) -> Fraction:
        """Convert from counts to units, exactly.

        Raise :class:`~stagewire.errors.BadValueError` for a value that is not a number.
        """
        return exact(counts) / self.counts_per_unit

    def __repr__(self) -> str:
        return f"<Scale {self.counts_per_unit} counts per {self.unit}>"


@dataclass(frozen=True, slots=True, repr=False)
class UnknownScale:
    """A scale that is not documented; every conversion raises :class:`UnknownScaleError`."""

    unit: str
    reason: str

    def _refuse(self) -> NoReturn:
        raise UnknownScaleError(
            f"the scale in {self.unit} is unknown: {self.reason}; use raw counts"
        )

    def to_counts(self, value: Number) -> int:
        """Raise :class:`UnknownScaleError`."""
        self._refuse()

    def from_counts(self, counts: int) -> Fraction:
        """Raise :class:`UnknownScaleError`."""
        self._refuse()

    def __repr__(self) -> str:
        return f"<UnknownScale in {self.unit}: {self.reason}>"


@dataclass(frozen=True, slots=True, repr=False)
class ScaleConflict(UnknownScale):
    """A scale whose sources contradict each other; conversions are refused until the user chooses a source.

    :param scales: source -> its scale.
    """

    scales: Mapping[str, Scale]

    @classmethod
    def of(cls, unit: str, scales: Mapping[str, Scale]) -> ScaleConflict:
        """Return the scale in ``unit``, with a reason that states the figure of each source."""
        figures = "; ".join(
            f"{name}: {float(scale.counts_per_unit):.10g} counts per {unit} ({scale.source})"
            for name, scale in scales.items()
        )
        ways = " or ".join(f'scale_source="{name}"' for name in scales)
        reason = f"its sources contradict each other ({figures}); pass {ways} to open"
        return cls(unit, reason, scales)

    def __repr__(self) -> str:
        return f"<ScaleConflict in {self.unit}: {', '.join(self.scales)}>"


@dataclass(frozen=True, slots=True, repr=False)
class Limit:
    """A limit of a stage.

    :param value: exact value in ``unit``.
    :param unit: ``mm``, ``mm/s`` or ``mm/s^2``; for a rotary stage ``deg``, ``deg/s`` or ``deg/s^2``.
    :param source: origin of the value, for messages.
    """

    value: Fraction
    unit: str
    source: str

    @classmethod
    def of(cls, value: Number, unit: str, source: str) -> Limit:
        """Return a limit; raise :class:`~stagewire.errors.BadValueError` for a value that is not positive."""
        number = exact(value)
        if number <= 0:
            raise BadValueError(f"a limit must be above 0, not {value}")
        return cls(number, unit, source)

    def __repr__(self) -> str:
        return f"<Limit {float(self.value):.10g} {self.unit}: {self.source}>"


@dataclass(frozen=True, slots=True)
class UnknownLimit:
    """A limit that is not documented, and so is not checked.

    :param reason: why it is unknown, for messages.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class EndlessTravel:
    """The travel of a stage without ends, such as a rotation stage.

    :param source: origin of the fact, for messages.
    """

    source: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Stage:
    """A stage: its limits, and its scales on each controller in the registry that drives it.

    Use :meth:`of_user` to describe a stage that is not in the registry.

    :param scales: controller family -> quantity -> scale.
    :param controllers: controller family -> units of the family.
    :param by_user: whether a user defined the scales; those of the family with an empty name then apply on
        every controller.
    :param limits: ``travel``, ``max_velocity`` and ``max_acceleration`` -> limit; missing limits are unknown.
    :param catalogue: names in the catalogue of the vendor, such as ``MTS25/M-Z8``.
    :param rotary: whether it rotates; its scales and limits are then in degrees.
    :param ids: message and field, such as ``HW_GET_INFO.stage_id`` -> number of the stage there.
    :param defaults: message that sets parameters -> field -> the value with which the vendor's program
        drives the stage, as a number in mm or degrees, or the name of a value; missing values are unknown.
    :param defaults_source: source of these values.
    """

    name: str
    title: str
    page: int
    scales: Mapping[str, Mapping[str, Scale | UnknownScale]]
    controllers: Mapping[str, tuple[str, ...]]
    by_user: bool = False
    limits: Mapping[str, Limit | UnknownLimit | EndlessTravel] = field(default_factory=dict)
    catalogue: tuple[str, ...] = ()
    rotary: bool = False
    ids: Mapping[str, int] = field(default_factory=dict)
    defaults: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    defaults_source: str = ""

    @classmethod
    def of_user(
        cls,
        name: str,
        *,
        travel_mm: Number | None = None,
        max_velocity_mm_per_s: Number | None = None,
        max_acceleration_mm_per_s2: Number | None = None,
        travel_deg: Number | None = None,
        max_velocity_deg_per_s: Number | None = None,
        max_acceleration_deg_per_s2: Number | None = None,
        rotary: bool = False,
        **scales: Scale,
    ) -> Stage:
        """Return a stage that is not in the registry, with its scales by quantity.

        ``Stage.of_user("slide", position=Scale.counts_per("mm", 20000))`` is an example. Quantities, such as
        ``position``, ``velocity`` and ``acceleration``, and their units are those of the registry.

        :param rotary: whether it rotates; its scales are then in degrees, such as ``Scale.counts_per("deg",
            1919)``.
        :param travel_mm: length of the travel, from one end to the other.
        :param max_velocity_mm_per_s: maximum velocity.
        :param max_acceleration_mm_per_s2: maximum acceleration.
        :param travel_deg: travel of a rotary stage with ends, from one end to the other.
        :param max_velocity_deg_per_s: maximum velocity of a rotary stage.
        :param max_acceleration_deg_per_s2: maximum acceleration of a rotary stage.

        A limit that is left out is not checked. Raise :class:`~stagewire.errors.BadValueError` for a limit
        that is not positive, in mm for a rotary stage, or in degrees for another one.
        """
        linear = {
            "travel": (travel_mm, "mm"),
            "max_velocity": (max_velocity_mm_per_s, "mm/s"),
            "max_acceleration": (max_acceleration_mm_per_s2, "mm/s^2"),
        }
        angular = {
            "travel": (travel_deg, "deg"),
            "max_velocity": (max_velocity_deg_per_s, "deg/s"),
            "max_acceleration": (max_acceleration_deg_per_s2, "deg/s^2"),
        }
        stated, others = (angular, linear) if rotary else (linear, angular)
        if any(value is not None for value, _ in others.values()):
            kind, unit = ("rotary", "deg") if rotary else ("linear", "mm")
            raise BadValueError(f"{name}: a {kind} stage has limits in {unit} only")
        limits = {
            limit: Limit.of(value, unit, "your own stage")
            for limit, (value, unit) in stated.items()
            if value is not None
        }
        own: dict[str, Mapping[str, Scale | UnknownScale]] = {"": dict(scales)}
        return cls(
            name, "your own stage", 0, own, {"": ()}, by_user=True, limits=limits, rotary=rotary
        )

    def is_known_on(self, controller: str) -> bool:
        """Return whether the registry has scales of the stage on a controller (a family or a unit)."""
        return any(
            controller == group or controller in units for group, units in self.controllers.items()
        )

    def scale(self, quantity: str, controller: str) -> Scale | UnknownScale:
        """Return the scale of ``quantity`` on ``controller`` (a family or a unit).

        Raise :class:`UnknownScaleError` if the registry does not state it. Scales are never guessed.
        """
        for family, scales in self.scales.items():
            everywhere = self.by_user and not family
            if everywhere or controller == family or controller in self.controllers[family]:
                if quantity in scales:
                    return scales[quantity]
                known = ", ".join(sorted(scales))
                raise UnknownScaleError(
                    f"the scale of {quantity} of {self.name} on {controller} is unknown (known: {known})"
                )
        known = ", ".join(sorted(self.scales))
        raise UnknownScaleError(
            f"the scales of {self.name} on {controller} are unknown (known on: {known})"
        )

    def __repr__(self) -> str:
        return f"<Stage {self.name}: {self.title}>"


def stages_of(package: str) -> list[Stage]:
    """Return all stages of a generated package."""
    from importlib import import_module

    return [
        one for one in vars(import_module(f"{package}.stages")).values() if isinstance(one, Stage)
    ]


def find_stages(package: str, name: str) -> list[Stage]:
    """Return the stages of a generated package with a name in any case.

    The name in the registry belongs to one stage. A name in the catalogue may belong to several, such as the
    axes of a stage.
    """
    stages = stages_of(package)
    wanted = name.upper()
    named = [one for one in stages if one.name.upper() == wanted]
    return named or [one for one in stages if wanted in map(str.upper, one.catalogue)]

"""Exact conversion between engineering units and the counts on the wire.

A scale is a rational number, never a float: ``Scale.counts_per("mm", 20000)`` or
``Scale.unit_per("us", 512, 5)``.
Counts are rounded to the nearest integer, ties away from zero, on both sides of zero alike.
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
    "Limit",
    "Number",
    "Scale",
    "Stage",
    "UnknownLimit",
    "UnknownScale",
    "exact",
    "round_half_away",
]

Number = int | float | Decimal | Fraction | str


_BEYOND: Final = 10**60
_LONGEST: Final = 1000  # characters of a text, bits of an integer
_EXPONENT: Final = 3  # digits of an exponent


def exact(value: Number) -> Fraction:
    """Return ``value`` as a fraction.

    A float stands for the shortest decimal that prints like it, so 0.1 is one tenth and not the
    binary number beside it. Raises :class:`BadValueError` for NaN, infinity, a bool, text that is
    no number, and numbers that no quantity has: from 10**60 on, or with an exponent of four digits.
    """
    if _is_vast(value):
        raise BadValueError("the number is far beyond any range")
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
        raise BadValueError("the number is far beyond any range")
    return number


def _is_vast(value: object) -> bool:
    """Say whether a number has more digits than a program should spend time on.

    ``10**exponent`` is computed exactly: with a huge exponent that would stop every thread for minutes.
    """
    if isinstance(value, str):
        exponent = value.lower().partition("e")[2].strip().lstrip("+-")
        return len(value) > _LONGEST or len(exponent.lstrip("0")) > _EXPONENT
    if isinstance(value, Decimal) and value.is_finite():
        return len(str(abs(value.adjusted()))) > _EXPONENT
    return isinstance(value, int) and value.bit_length() > _LONGEST


def round_half_away(value: Fraction) -> int:
    """Round to the nearest integer; a half goes away from zero."""
    magnitude = math.floor(abs(value) + Fraction(1, 2))
    return magnitude if value >= 0 else -magnitude


@dataclass(frozen=True, slots=True, repr=False)
class Scale:
    """How many counts on the wire make one unit, as an exact rational.

    :param counts_per_unit: positive; counts for one ``unit``.
    :param unit: the engineering unit, such as ``mm/s``.
    :param printed: the factor as the document prints it, rounded perhaps; for the reader only.
    :param source: where the factor comes from when it is not the document's.

    Raises :class:`~stagewire.errors.BadValueError` for a factor that is not positive.
    """

    counts_per_unit: Fraction
    unit: str
    printed: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        """Refuse what is no scale."""
        if self.counts_per_unit <= 0:
            raise BadValueError(f"a scale is positive, not {self.counts_per_unit}")

    @classmethod
    def counts_per(
        cls, unit: str, numerator: int, denominator: int = 1, printed: str = "", source: str = ""
    ) -> Scale:
        """Make the scale of ``numerator/denominator`` counts for one unit."""
        return cls(Fraction(numerator, denominator), unit, printed, source)

    @classmethod
    def unit_per(
        cls, unit: str, numerator: int, denominator: int = 1, printed: str = "", source: str = ""
    ) -> Scale:
        """Make the scale of ``numerator/denominator`` units for one count."""
        return cls(Fraction(denominator, numerator), unit, printed, source)

    def to_counts(self, value: Number) -> int:
        """Convert from units to counts: exact factor, nearest integer, ties away from zero.

        Raises :class:`~stagewire.errors.BadValueError` for what is no number. The counts may be
        outside the range of a field; making the message refuses them.
        """
        return round_half_away(exact(value) * self.counts_per_unit)

    def from_counts(self, counts: int) -> Fraction:
        """Convert from counts to units, exactly.

        Raises :class:`~stagewire.errors.BadValueError` for what is no number.
        """
        return exact(counts) / self.counts_per_unit

    def __repr__(self) -> str:
        return f"<Scale {self.counts_per_unit} counts per {self.unit}>"


@dataclass(frozen=True, slots=True, repr=False)
class UnknownScale:
    """A scale that no document states; every conversion raises :class:`UnknownScaleError`."""

    unit: str
    reason: str

    def _refuse(self) -> NoReturn:
        raise UnknownScaleError(f"no scale in {self.unit} is known: {self.reason}; use raw counts")

    def to_counts(self, value: Number) -> int:
        """Raise :class:`UnknownScaleError`."""
        self._refuse()

    def from_counts(self, counts: int) -> Fraction:
        """Raise :class:`UnknownScaleError`."""
        self._refuse()

    def __repr__(self) -> str:
        return f"<UnknownScale in {self.unit}: {self.reason}>"


@dataclass(frozen=True, slots=True, repr=False)
class Limit:
    """A limit of a stage.

    :param value: exact, in ``unit``.
    :param unit: ``mm``, ``mm/s`` or ``mm/s^2``.
    :param source: where the value comes from, for people.
    """

    value: Fraction
    unit: str
    source: str

    @classmethod
    def of(cls, value: Number, unit: str, source: str) -> Limit:
        """Make a limit; raises :class:`~stagewire.errors.BadValueError` for a value that is not positive."""
        number = exact(value)
        if number <= 0:
            raise BadValueError(f"a limit is above 0, not {value}")
        return cls(number, unit, source)

    def __repr__(self) -> str:
        return f"<Limit {float(self.value):.10g} {self.unit}: {self.source}>"


@dataclass(frozen=True, slots=True)
class UnknownLimit:
    """A limit that no source states; what it would limit is not checked.

    :param reason: for people.
    """

    reason: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Stage:
    """A stage: its scales on each controller that the registry knows it on, and its limits.

    One that the registry does not know is made by :meth:`of_user`.

    :param scales: controller -> quantity -> scale.
    :param controllers: controller -> the units that it stands for.
    :param by_user: whether its scales are those of a user, who answers for them on any controller.
    :param limits: ``travel``, ``max_velocity`` and ``max_acceleration`` -> the limit; unknown if missing.
    """

    name: str
    title: str
    page: int
    scales: Mapping[str, Mapping[str, Scale | UnknownScale]]
    controllers: Mapping[str, tuple[str, ...]]
    by_user: bool = False
    limits: Mapping[str, Limit | UnknownLimit] = field(default_factory=dict)

    @classmethod
    def of_user(
        cls,
        name: str,
        *,
        travel_mm: Number | None = None,
        max_velocity_mm_per_s: Number | None = None,
        max_acceleration_mm_per_s2: Number | None = None,
        **scales: Scale,
    ) -> Stage:
        """Make a stage that the registry does not know, with scales by quantity.

        ``Stage.of_user("rotary", position=Scale.counts_per("mm", 1919))``: the quantities are those of the
        registry, such as ``position``, ``velocity`` and ``acceleration``, and so are their units.

        :param travel_mm: its length, from one end to the other.
        :param max_velocity_mm_per_s: the highest velocity that may be set.
        :param max_acceleration_mm_per_s2: the highest acceleration that may be set.

        A limit that is left out is unknown, and is not checked. Raises
        :class:`~stagewire.errors.BadValueError` for a limit that is not positive.
        """
        stated = {
            "travel": (travel_mm, "mm"),
            "max_velocity": (max_velocity_mm_per_s, "mm/s"),
            "max_acceleration": (max_acceleration_mm_per_s2, "mm/s^2"),
        }
        limits = {
            limit: Limit.of(value, unit, "a stage of yours")
            for limit, (value, unit) in stated.items()
            if value is not None
        }
        own: dict[str, Mapping[str, Scale | UnknownScale]] = {"": dict(scales)}
        return cls(name, "a stage of yours", 0, own, {"": ()}, by_user=True, limits=limits)

    def is_known_on(self, controller: str) -> bool:
        """Say whether the registry has scales of the stage on a controller (a group, or a unit of it)."""
        return any(
            controller == group or controller in units for group, units in self.controllers.items()
        )

    def scale(self, quantity: str, controller: str) -> Scale | UnknownScale:
        """Return the scale of ``quantity`` on ``controller`` (its family, or a unit of it).

        Raises :class:`UnknownScaleError` when the registry has none; nothing is guessed.
        """
        for family, scales in self.scales.items():
            if self.by_user or controller == family or controller in self.controllers[family]:
                if quantity in scales:
                    return scales[quantity]
                known = ", ".join(sorted(scales))
                raise UnknownScaleError(
                    f"{quantity} of {self.name} on {controller} is not known (known: {known})"
                )
        known = ", ".join(sorted(self.scales))
        raise UnknownScaleError(f"{self.name} on {controller} is not known (known on: {known})")

    def __repr__(self) -> str:
        return f"<Stage {self.name}: {self.title}>"

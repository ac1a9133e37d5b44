"""Permissions of a run, and the exact range of a motion."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import Final

from stagewire.errors import StagewireError, UnknownScaleError
from stagewire.quantities import Scale
from stagewire_conformance.scales import in_unit

COUNTS: Final = "counts"
"""The unit of raw values, as they appear on the wire."""

_NUMBER: Final = r"[-+]?[0-9]{1,15}(?:\.[0-9]{1,15})?"
_RANGE: Final = re.compile(rf" *({_NUMBER}) *\.\. *({_NUMBER}) *([A-Za-zµμ]+) *")
_UNITS: Final = ("m", "mm", "um", "nm", "deg", "V", "mV")


class RangeError(StagewireError):
    """An invalid range, or a range that cannot be converted to counts."""


@dataclass(frozen=True)
class Range:
    """A range of positions or voltages. Both ends are included.

    :param unit: ``counts``, or a unit such as ``mm``, ``um``, ``deg`` or ``V``.

    Raises :class:`RangeError` if the ends are in the wrong order, or if counts are not integers.
    """

    minimum: Fraction
    maximum: Fraction
    unit: str

    def __post_init__(self) -> None:
        """Refuse an invalid range."""
        if self.unit not in (COUNTS, *_UNITS):
            known = ", ".join((COUNTS, *_UNITS))
            raise RangeError(f"{self}: unknown unit {self.unit} (choose one of {known})")
        if self.minimum > self.maximum:
            raise RangeError(f"{self}: the first number must not exceed the second")
        if self.unit == COUNTS and {self.minimum.denominator, self.maximum.denominator} != {1}:
            raise RangeError(f"{self}: counts must be integers")

    @classmethod
    def parse(cls, text: str) -> Range:
        """Parse a range such as ``0..5mm``, ``-1.5..1.5deg``, ``0..100000counts`` or ``0..20V``.

        Raises :class:`RangeError` for an invalid text.
        """
        found = _RANGE.fullmatch(text)
        if found is None:
            raise RangeError(
                f"expected a range with its unit, such as 0..5mm or 0..100000counts, not {text!r}"
            )
        unit = found[3].replace("µ", "u").replace("μ", "u")
        return cls(Fraction(found[1]), Fraction(found[2]), unit)

    def in_unit(self, unit: str) -> tuple[Fraction, Fraction]:
        """Return both ends in another unit, exactly.

        Raises :class:`RangeError` if the units measure different quantities.
        """
        try:
            return in_unit(self.minimum, self.unit, unit), in_unit(self.maximum, self.unit, unit)
        except UnknownScaleError:
            raise RangeError(f"{self} cannot be converted to {unit}") from None

    def in_counts(self, scale: Scale | None) -> tuple[int, int]:
        """Return the first and the last count within the range.

        :param scale: of the counts; None if unknown, so that the range must be in counts.

        Raises :class:`RangeError` if the range contains no count, or if the scale is missing.
        """
        if self.unit == COUNTS:
            return int(self.minimum), int(self.maximum)
        if scale is None:
            raise RangeError(f"{self}: the number of counts per {self.unit} is not known")
        low, high = (end * scale.counts_per_unit for end in self.in_unit(scale.unit))
        first, last = math.ceil(low), math.floor(high)
        if first > last:
            raise RangeError(f"{self} contains no whole count")
        return first, last

    def __str__(self) -> str:
        return f"{_decimal(self.minimum)}..{_decimal(self.maximum)}{self.unit}"


def _decimal(value: Fraction) -> str:
    """Return a number as a decimal without an exponent, exactly: it was read from a decimal."""
    return f"{Decimal(value.numerator) / Decimal(value.denominator):f}"


_ALWAYS: Final = ("none", "stream", "stop")
"""Effects of messages that may always be sent."""


class Need(StrEnum):
    """A permission that a check needs. The last six are hazards of the registry."""

    SETTINGS = "settings"
    TUNING = "tuning"
    MOTION = "motion"
    EEPROM = "eeprom"
    LASER = "laser"
    HEATER = "heater"
    SHUTTER = "shutter"
    PIEZO = "piezo"
    ZERO = "zero"
    INERTIAL = "inertial"


HAZARDS: Final = frozenset(
    {Need.LASER, Need.HEATER, Need.SHUTTER, Need.PIEZO, Need.ZERO, Need.INERTIAL}
)
"""The permissions for messages that can switch an output on or change one."""
WITHOUT_RANGE: Final = frozenset({Need.LASER, Need.HEATER})
"""Hazards of outputs that have no range of positions or voltages, so that ``motion`` is not needed."""


def needs_of(effect: str | None, hazard: str = "") -> frozenset[Need] | None:
    """Return the permissions that sending a message needs; None if it is never sent.

    :param effect: of the message in the registry; None if controllers do not receive it.
    :param hazard: of the message in the registry; empty if it has none.
    """
    if effect in _ALWAYS:
        return frozenset()
    if effect is None or effect not in _EFFECTS:
        return None
    needs = {Need(effect), *([Need(hazard)] if hazard else [])}
    return frozenset(needs - {Need.MOTION} if needs & WITHOUT_RANGE else needs)


_EFFECTS: Final = frozenset(set(Need) - HAZARDS)


@dataclass(frozen=True)
class Permissions:
    """The permissions of a run. Sending requests is always allowed.

    :param settings: change settings, and restore them.
    :param motion: move stages and drive outputs within a range.
    :param eeprom: write to non-volatile memory.
    :param tuning: change the gains and currents of control loops, and restore them.
    :param laser: switch laser output on, and change its power or current.
    :param heater: change the current of a thermoelectric cooler.
    :param shutter: open shutters.
    :param piezo: change the output voltages of piezo drivers, also by their loops and sources.
    :param zero: let piezo actuators move through their whole range to find the zero.
    :param inertial: change the drive voltages of inertial motors.
    """

    settings: bool = False
    motion: Range | None = None
    eeprom: bool = False
    tuning: bool = False
    laser: bool = False
    heater: bool = False
    shutter: bool = False
    piezo: bool = False
    zero: bool = False
    inertial: bool = False

    @property
    def granted(self) -> frozenset[Need]:
        """The permissions that are granted."""
        return frozenset(need for need in Need if getattr(self, need))

    def opens(self, effect: str | None, hazard: str = "") -> bool:
        """Return whether messages with this effect and hazard may be sent.

        Both are those of the registry. ``connection`` and ``reset`` are never allowed.
        """
        needs = needs_of(effect, hazard)
        return needs is not None and needs <= self.granted

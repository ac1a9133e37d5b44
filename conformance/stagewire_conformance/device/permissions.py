"""Permissions of a run: what it may do besides asking, and the exact range of a motion."""

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
"""The unit of raw values as they are on the wire."""

_NUMBER: Final = r"[-+]?[0-9]{1,15}(?:\.[0-9]{1,15})?"
_RANGE: Final = re.compile(rf" *({_NUMBER}) *\.\. *({_NUMBER}) *([A-Za-zµμ]+) *")
_UNITS: Final = ("m", "mm", "um", "nm", "V", "mV")


class RangeError(StagewireError):
    """A range that is none, or that says nothing of what it is to be applied to."""


@dataclass(frozen=True)
class Range:
    """From where to where; both ends belong to it.

    :param unit: ``counts``, or a unit such as ``mm``, ``um`` or ``V``.

    Raises :class:`RangeError` for ends in the wrong order, and for counts that are not whole.
    """

    minimum: Fraction
    maximum: Fraction
    unit: str

    def __post_init__(self) -> None:
        """Refuse what is no range."""
        if self.unit not in (COUNTS, *_UNITS):
            known = ", ".join((COUNTS, *_UNITS))
            raise RangeError(f"{self}: there is no unit {self.unit} (there are: {known})")
        if self.minimum > self.maximum:
            raise RangeError(f"{self}: the lower end comes first")
        if self.unit == COUNTS and {self.minimum.denominator, self.maximum.denominator} != {1}:
            raise RangeError(f"{self}: counts are whole numbers")

    @classmethod
    def parse(cls, text: str) -> Range:
        """Read a range such as ``0..5mm``, ``-1.5..1.5mm``, ``0..100000counts`` or ``0..20V``.

        Raises :class:`RangeError` for a text that is none.
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

        Raises :class:`RangeError` for a unit of another kind.
        """
        try:
            return in_unit(self.minimum, self.unit, unit), in_unit(self.maximum, self.unit, unit)
        except UnknownScaleError:
            raise RangeError(f"{self} is no range in {unit}") from None

    def in_counts(self, scale: Scale | None) -> tuple[int, int]:
        """Return the first and the last count that lie in the range.

        :param scale: of the counts; None: it is not known, so that only counts can be told.

        Raises :class:`RangeError` where no count lies in it, or nothing says which.
        """
        if self.unit == COUNTS:
            return int(self.minimum), int(self.maximum)
        if scale is None:
            raise RangeError(f"{self}: nothing says how many counts make one {self.unit}")
        low, high = (end * scale.counts_per_unit for end in self.in_unit(scale.unit))
        first, last = math.ceil(low), math.floor(high)
        if first > last:
            raise RangeError(f"{self} lies between two counts")
        return first, last

    def __str__(self) -> str:
        return f"{_decimal(self.minimum)}..{_decimal(self.maximum)}{self.unit}"


def _decimal(value: Fraction) -> str:
    """Return a number as it is written, without an exponent: what was read has an end in decimals."""
    return f"{Decimal(value.numerator) / Decimal(value.denominator):f}"


_ALWAYS: Final = ("none", "stream", "stop")
"""Effects of messages that may always be sent."""


class Need(StrEnum):
    """What a check does beyond asking, so that it runs only where that was allowed."""

    SETTINGS = "settings"
    MOTION = "motion"
    EEPROM = "eeprom"


@dataclass(frozen=True)
class Permissions:
    """What was allowed. Asking always is.

    :param settings: change settings, and put them back.
    :param motion: move, and whatever else does something to what is connected, within a range.
    :param eeprom: write the memory that outlasts a power cycle.
    """

    settings: bool = False
    motion: Range | None = None
    eeprom: bool = False

    @property
    def granted(self) -> frozenset[Need]:
        """The needs that are met."""
        met = {
            Need.SETTINGS: self.settings,
            Need.MOTION: self.motion is not None,
            Need.EEPROM: self.eeprom,
        }
        return frozenset(need for need, is_met in met.items() if is_met)

    def opens(self, effect: str | None) -> bool:
        """Return whether a message of this effect may be sent to a controller.

        The effects are those of the registry; ``connection`` and ``reset`` are opened by nothing.
        """
        return effect in _ALWAYS or effect in self.granted

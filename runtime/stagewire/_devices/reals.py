"""Real numbers of IEEE 754, which messages carry as bit patterns."""

from __future__ import annotations

import struct
from typing import Final

_CODES: Final = {4: ("<f", "<I"), 8: ("<d", "<Q")}

_LARGEST: Final = 3.4028234e38
"""The largest single-precision number, rounded down."""


def pattern_of(number: float, size: int) -> int:
    """Return the bit pattern of the real number of ``size`` bytes that is nearest to a number.

    Raise :class:`OverflowError` if the number is too large for the size.
    """
    real, integer = _CODES[size]
    found: int = struct.unpack(integer, struct.pack(real, number))[0]
    return found


def number_of(pattern: int, size: int) -> float:
    """Return the real number with a bit pattern: the shortest decimal that has this pattern."""
    real, integer = _CODES[size]
    number: float = struct.unpack(real, struct.pack(integer, pattern))[0]
    if size == 4 and number - number == 0:  # finite
        for digits in range(1, 10):
            shorter = float(f"{number:.{digits}g}")
            if abs(shorter) < _LARGEST and pattern_of(shorter, size) == pattern:
                return shorter
    return number

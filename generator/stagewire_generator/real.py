"""Real numbers of IEEE 754, whose value on the wire is their bit pattern.

Patterns of numbers that are not negative have the same order as the numbers, so a range of patterns is a
range of numbers.
"""

from __future__ import annotations

import struct
from decimal import Decimal

_CODES = {4: ("<f", "<I"), 8: ("<d", "<Q")}
SIZES = tuple(_CODES)
"""The sizes of real numbers, in bytes."""


def pattern_of(number: int | str, size: int) -> int:
    """Return the bit pattern of the real number that is nearest to an integer or a decimal."""
    real, integer = _CODES[size]
    found: int = struct.unpack(integer, struct.pack(real, float(Decimal(number))))[0]
    return found


def number_of(pattern: int, size: int) -> str:
    """Return the shortest decimal of the real number with a bit pattern."""
    real, integer = _CODES[size]
    value: float = struct.unpack(real, struct.pack(integer, pattern))[0]
    if size == 4:
        digits = next(n for n in range(1, 10) if _same(value, float(f"{value:.{n}g}")))
        value = float(f"{value:.{digits}g}")
    text = repr(value)
    return text.removesuffix(".0")


def _same(value: float, other: float) -> bool:
    try:
        return struct.pack("<f", value) == struct.pack("<f", other)
    except OverflowError:  # rounded up beyond the largest number
        return False

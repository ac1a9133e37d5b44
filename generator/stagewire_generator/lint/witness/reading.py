"""How printed names and numbers are read."""

from __future__ import annotations

import re
from collections.abc import Iterable

from stagewire_generator.model import Field

__all__ = [
    "FILLERS",
    "count",
    "find_field",
    "limit",
    "number",
    "same_name",
    "squash",
]

# What the document calls bytes without a meaning.
FILLERS = frozenset({"notused", "unused", "reserved", "futureuse", "na"})

_NUMBER = re.compile(r"(-?)(?:0x)?([0-9A-Fa-f][0-9A-Fa-f,]*)\Z")
_TIME = re.compile(r"([0-9][0-9,]*)(m?)s\Z")
_COUNTS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def squash(text: str) -> str:
    """Reduce a name to its letters and digits, so that ``Jog Mode`` is ``jog_mode``."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


def same_name(printed: str, field: Field) -> bool:
    """Whether a printed name is the field's; any filler names a reserved field."""
    if squash(printed) == squash(field.name):
        return True
    return field.role == "reserved" and squash(printed) in FILLERS


def find_field(fields: Iterable[Field], printed: str) -> Field | None:
    """Find the field that a list of values, or a range, is printed for."""
    wanted = squash(printed)
    candidates = list(fields)
    for field in candidates:
        if squash(field.name) in (wanted, wanted.removesuffix("s")):
            return field
    for field in candidates:
        if wanted.removesuffix("s") in squash(field.name) or squash(field.name) in wanted:
            return field
    return None


def number(text: str, maximum: int) -> int | None:
    """Read a printed number; letters and 0x make it hexadecimal.

    A negative hexadecimal number in a byte is its two's complement: -0x01 is 0xFF.
    """
    match = _NUMBER.match(text.strip().removeprefix("to "))
    if match is None:
        return None
    digits = match[2].replace(",", "")
    hexadecimal = "0x" in text or not digits.isdigit()
    value = int(digits, 16 if hexadecimal else 10)
    value = -value if match[1] else value
    if value < 0 and maximum == 0xFF and "0x" in text:
        return value & 0xFF
    return value


def limit(text: str, field: Field) -> int | None:
    """Read a printed limit of a field; a time such as 10,000s becomes counts."""
    factor = field.quantity.factor if field.quantity and field.unit == "ms" else None
    time = _TIME.match(text)
    if factor and time:
        milliseconds = int(time[1].replace(",", "")) * (1 if time[2] else 1000)
        return int(milliseconds * factor.counts_per_unit)
    return number(text, field.format.maximum)


def count(text: str) -> int | str:
    """Read a number in figures or, up to nine, in words; what is neither stays as it is."""
    if text in _COUNTS:
        return _COUNTS.index(text)
    return int(text) if text.isdecimal() else text

"""Positions and steps of the panel, in the unit of an axis."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final

from stagewire.errors import BadValueError
from stagewire.quantities import exact
from stagewire_cli.devices import keywords

COUNTS: Final = "counts"

STEPS: Final = {
    "mm": ("0.001", "0.01", "0.1", "1", "10"),
    "deg": ("0.001", "0.01", "0.1", "1", "10"),
    "um": ("1", "10", "100", "1000", "10000"),
    COUNTS: ("10", "100", "1000", "10000", "100000"),
}
"""Unit -> the steps of a jog. The middle one is chosen first."""

_TRAVEL: Final = re.compile(
    r"(?:travel|limits of the controller): (\S+) to (\S+) (mm|deg|um|counts)\b"
)
_LENGTH: Final = re.compile(r"travel: (\S+ (?:mm|deg))\b")
_PER: Final = {("mm", "um"): 1000}


def parse(text: str, unit: str) -> Fraction:
    """Return a typed number.

    :param text: with or without the unit.
    :param unit: that of the axis.

    Raises :class:`~stagewire.errors.BadValueError` for anything else.
    """
    number = text.strip().removesuffix(unit).strip()
    try:
        value = exact(number)
    except BadValueError:
        raise BadValueError(f"expected a number in {unit}, not {text.strip()!r}") from None
    if unit == COUNTS and value.denominator != 1:
        raise BadValueError(f"counts are whole numbers, not {text.strip()!r}")
    return value


def given(call: Callable[..., Any], value: Fraction, unit: str) -> dict[str, Fraction | int]:
    """Return the keyword of a call for a number in a unit.

    Raises :class:`~stagewire.errors.BadValueError` if the call has none for this unit.
    """
    if unit not in keywords(call):
        raise BadValueError(f"this controller accepts no target in {unit}")
    return {unit: int(value) if unit == COUNTS else value}


def travel_of(described: str, unit: str) -> tuple[tuple[float, float] | None, str]:
    """Return the ends of the travel in a unit, and the travel in words.

    :param described: a part as text (``str(part)``).
    """
    for low, high, own in _TRAVEL.findall(described):
        factor = 1 if own == unit else _PER.get((own, unit))
        if factor is not None:
            ends = float(low) * factor, float(high) * factor
            return ends, f"{ends[0]:.10g} to {ends[1]:.10g} {unit}"
    if "travel: endless" in described:
        return None, "endless"
    length = _LENGTH.search(described)
    return None, f"{length[1]} long, ends unknown" if length else "unknown"

"""The state of one part of a controller, read and formatted for people."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from stagewire.devices import Bits, BitsByUnit, InUnits, Raw, Real, Values
from stagewire.errors import UnknownScaleError

_STATUS_METHODS = (
    "get_dc_status_update",
    "get_status_update",
    "read_motor_position_and_status",
    "get_pz_status_bits",
    "get_status_bits",
)
"""The methods that read position and state, the most informative first."""


@dataclass(frozen=True, slots=True)
class Value:
    """A number with its unit; the unit is empty for raw counts."""

    number: float
    unit: str = ""

    def __str__(self) -> str:
        if not self.unit:
            return f"{self.number:.0f}"
        return f"{self.number:.4f} {self.unit}"


def status_of(part: Any) -> Values[Any] | None:
    """Read the status of a part; return None if its unit has no such request.

    Raises the errors of requests.
    """
    for name in _STATUS_METHODS:
        method = getattr(part, name, None)
        if method is not None:
            values: Values[Any] = method()
            return values
    return None


def flags_of(values: Values[Any]) -> tuple[str, ...]:
    """Return the names of the bits that are set in a status; empty without bits."""
    for name in values.names:
        if isinstance(getattr(type(values), name), Bits | BitsByUnit):
            return tuple(getattr(values, name).names)
    return ()


def numbers_of(values: Values[Any]) -> dict[str, Value]:
    """Return the numbers of a message by field, in units if the scale is known, else in counts."""
    numbers: dict[str, Value] = {}
    for name in values.names:
        described = getattr(type(values), name)
        if isinstance(described, InUnits):
            with suppress(UnknownScaleError, AttributeError):
                numbers[described.field] = Value(getattr(values, name), described.unit)
        elif isinstance(described, Raw | Real):
            with suppress(AttributeError):  # a shorter form of the message lacks it
                numbers[described.field] = Value(getattr(values, name))
    return numbers


def in_words(value: Value | None, unknown: str) -> str:
    """Return a number with its unit, or counts."""
    if value is None:
        return unknown
    return str(value) if value.unit else f"{value} counts"

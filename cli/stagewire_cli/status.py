"""The state of one part of a controller, read and formatted for people."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from stagewire.devices import Bits, BitsByUnit, InUnits, Raw, Values
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


@dataclass(frozen=True, slots=True)
class Reading:
    """One status of one part.

    :param part: the bay, channel or axis; empty for a controller with a single part.
    :param time: seconds since the monitor began.
    :param values: its numbers by name, such as ``position``.
    :param flags: the names of the bits that are set; None without bits.
    """

    part: str
    time: float
    values: Mapping[str, Value]
    flags: tuple[str, ...] | None = None

    @property
    def state(self) -> str:
        """The flags in words; empty without flags, and a dash if none is set."""
        return "" if self.flags is None else ", ".join(self.flags) or "-"

    def line(self) -> str:
        """One line of text for this reading."""
        words = [f"{self.time:9.3f}", *([self.part] if self.part else [])]
        words += [f"{name}={value}" for name, value in self.values.items()]
        return "  ".join([*words, *([f"[{self.state}]"] if self.flags is not None else [])])


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


def reading_of(part: str, when: float, values: Values[Any]) -> Reading:
    """Return the reading in a status of a part."""
    flags: tuple[str, ...] | None = None
    for name in values.names:
        if isinstance(getattr(type(values), name), Bits | BitsByUnit):
            bits = getattr(values, name)
            flags = (*bits.names, *([hex(bits.unnamed)] if bits.unnamed else []))
    return Reading(part, when, numbers_of(values), flags)


def numbers_of(values: Values[Any]) -> dict[str, Value]:
    """Return the numbers of a message by field, in units if the scale is known, else in counts."""
    numbers: dict[str, Value] = {}
    for name in values.names:
        described = getattr(type(values), name)
        if isinstance(described, InUnits):
            with suppress(UnknownScaleError):
                numbers[described.field] = Value(getattr(values, name), described.unit)
        elif isinstance(described, Raw):
            numbers[described.field] = Value(getattr(values, name))
    return numbers

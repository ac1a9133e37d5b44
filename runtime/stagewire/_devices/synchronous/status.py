# Generated from _devices/asynchronous/status.py by `python tools/unasync.py`; do not edit.

"""Reads what every motor reports: its position, whether it is homed, and any bit of its status."""

from __future__ import annotations

from typing import Any, Final

from stagewire._devices.synchronous.calls import query
from stagewire._devices.synchronous.targets import HOMED, bits_in, position_in
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.travel import PER_MM, POSITION
from stagewire._devices.values import Values
from stagewire.errors import (
    BadValueError,
    MotionTimeoutError,
    UnknownScaleError,
    UnsupportedError,
)

_PER_MM: Final = {"um": 1000}
"""Unit of a position -> how many of it are a millimetre."""
_POLL: Final = 0.05
"""Seconds between two requests for the status."""


def position_counts(endpoint: Endpoint) -> int:
    """Return the position in counts.

    Raise :class:`~stagewire.errors.UnsupportedError` for a unit that reports none.
    """
    values = _read(endpoint, None)
    counts = position_in(values)
    if (
        counts is None and POSITION in values.message.layout.fields
    ):  # a status without a table of its own
        return int(getattr(values.message, POSITION))
    if counts is None:
        raise UnsupportedError(f"a {endpoint.connection.unit.name} reports no position of a motor")
    return counts


def position(endpoint: Endpoint, unit: str = "") -> float:
    """Return the position.

    :param unit: ``mm`` or ``deg``; empty: the unit of the stage.

    Raise :class:`~stagewire.errors.UnknownScaleError` if the scale is unknown or has another unit, and
    :class:`~stagewire.errors.UnsupportedError` for a unit that reports no position.
    """
    counts = position_counts(endpoint)
    scales = endpoint.scales()
    own = scales.unit_of(POSITION)
    if instead := scales.unit_instead(POSITION, unit):
        why = scales.other_unit(POSITION, unit)
        raise UnknownScaleError(f"{endpoint.name}: {why}; read position_{instead}")
    divisor = _PER_MM.get(own, 1) if unit == "mm" else 1
    scale = scales.of(POSITION, own if divisor != 1 else unit or own)
    return float(scale.from_counts(counts) / divisor)


def travel(endpoint: Endpoint) -> tuple[float, float] | None:
    """Return the ends of the travel in the unit of the position; None if they are unknown."""
    ends = endpoint.connection.limits(endpoint.place).travel
    if ends is None or ends.low is None:
        return None
    factor = PER_MM.get(endpoint.scales().unit_of(POSITION), 1)
    return float(ends.low * factor), float((ends.low + ends.length) * factor)


def is_homed(endpoint: Endpoint, timeout: float | None) -> bool:
    """Return whether the stage is homed.

    Raise :class:`~stagewire.errors.UnsupportedError` for a unit that does not report it.
    """
    unit = endpoint.connection.unit
    if unit.positions is None:  # a flipper has such a bit, but nothing to home
        for bits in bits_in(_read(endpoint, timeout)):
            if HOMED in bits.bits:
                return HOMED in bits.names
    raise UnsupportedError(f"a {unit.name} does not report whether it is homed")


def wait_for(
    endpoint: Endpoint, bit: str, timeout: float | None, *, on: bool = True
) -> Values[Any]:
    """Request the status until a bit is set, or until it is clear, and return the status.

    Raise :class:`~stagewire.errors.BadValueError` for an unknown bit,
    :class:`~stagewire.errors.UnsupportedError` for a unit without status bits, and
    :class:`~stagewire.errors.MotionTimeoutError`.
    """
    seconds = endpoint.motion_seconds(timeout)
    deadline = endpoint.deadline(seconds)
    while True:
        status = _read(endpoint, None)
        bits = list(bits_in(status))
        known = [name for flags in bits for name in flags.bits]
        if not known:
            name = endpoint.connection.unit.name
            raise UnsupportedError(f"a {name} has no status bits that can be waited for")
        if bit not in known:
            raise BadValueError(
                f"{endpoint.name}: wait_for: unknown status bit {bit!r} (choose {', '.join(known)})"
            )
        if on is any(bit in flags.names for flags in bits):
            return status
        if deadline.over:
            state = "set" if on else "clear"
            raise MotionTimeoutError(
                f"{endpoint.name}: the status bit {bit} was not {state} within {seconds:.3g} s"
            )
        endpoint.transport.pause(min(_POLL, deadline.left))


def _read(endpoint: Endpoint, timeout: float | None) -> Values[Any]:
    unit = endpoint.connection.unit
    if unit.status_query is None:
        raise UnsupportedError(f"a {unit.name} has no request for the status of a motor")
    return query(endpoint, unit.status_query, timeout, {})

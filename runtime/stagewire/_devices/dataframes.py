"""Statuses as a data frame of pandas, which is imported only here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any

from stagewire._codec.flags import Flags
from stagewire._devices.values import InUnits, Values
from stagewire._sessions.subscriptions import AsyncSubscription, BlockingSubscription
from stagewire.errors import BadValueError, UnsupportedError

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped,import-not-found,unused-ignore]


def dataframe(
    statuses: Values[Any]
    | Iterable[Values[Any]]
    | BlockingSubscription[Any]
    | AsyncSubscription[Any],
) -> DataFrame:
    """Return statuses, or other values that a controller reported, as a data frame of pandas.

    Each status is a row. The columns are ``received`` (seconds of the session), ``received_at`` (UTC), and
    the values: in units if the scale is known, such as ``position_mm``, else in counts. Each named bit is a
    column of its own that is true or false, such as ``status_bits.homed``. ``attrs["units"]`` of the frame
    has the unit of each column that has one.

    :param statuses: one status, several, or a subscription to values; those that are queued are then taken.

    Raise :class:`~stagewire.errors.UnsupportedError` if pandas is not installed, and
    :class:`~stagewire.errors.BadValueError` for anything else, such as messages.
    """
    try:
        pandas = import_module("pandas")
    except ImportError:
        raise UnsupportedError(
            "pandas is not installed: run pip install 'stagewire[pandas]'"
        ) from None
    units = {"received": "s"}
    rows = [_row(status, units) for status in _each(statuses)]
    frame: DataFrame = pandas.DataFrame(rows, columns=None if rows else ["received", "received_at"])
    frame.attrs["units"] = units
    return frame


def _each(statuses: Any) -> Iterator[Values[Any]]:
    if isinstance(statuses, BlockingSubscription | AsyncSubscription):
        statuses = iter(statuses.take, None)
    elif isinstance(statuses, Values):
        statuses = (statuses,)
    elif not isinstance(statuses, Iterable):
        raise BadValueError(f"dataframe takes statuses, not {statuses!r:.80}")
    for status in statuses:
        if not isinstance(status, Values):
            raise BadValueError(
                f"dataframe takes statuses, not {status!r:.80}; device.values() converts a message"
            )
        yield status


def _row(status: Values[Any], units: dict[str, str]) -> dict[str, Any]:
    """Return a row, and add the units of its columns."""
    row: dict[str, Any] = {"received": status.received, "received_at": status.received_at}
    plain = status.asdict()
    described = vars(type(status))
    for name, value in status.in_units():
        if isinstance(value, Flags):
            row.update((f"{name}.{bit}", bool(value & mask)) for bit, mask in value.bits.items())
            continue
        row[name] = plain[name]
        if isinstance(described[name], InUnits):
            units[name] = described[name].unit
    return row

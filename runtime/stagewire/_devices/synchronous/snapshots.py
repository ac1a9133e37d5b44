# Generated from _devices/asynchronous/snapshots.py by `python tools/unasync.py`; do not edit.

"""Reads all settings of a channel as plain data, and writes them back."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from typing import Any, Final, TypeAlias

from stagewire._devices.arguments import fields_of
from stagewire._devices.reals import number_of
from stagewire._devices.synchronous.calls import change, check_limits, check_rating, query
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.tables import ParameterSet
from stagewire.errors import BadValueError, ReplyTimeoutError, UnsupportedError

_log = logging.getLogger("stagewire")

Snapshot: TypeAlias = dict[str, Any]

_TUNING: Final = "tuning"


def snapshot(endpoint: Endpoint, timeout: float | None) -> Snapshot:
    """Return every set of parameters that can be read and written, by the name of its methods.

    Values are counts, or numbers if the field is a real number.

    A set whose request is not answered is left out, with a warning.

    Raise :class:`~stagewire.errors.UnsupportedError` for a unit without such sets.
    """
    settings: dict[str, dict[str, Any]] = {}
    tables = tuple(_tables(endpoint))
    if not tables:
        name = endpoint.connection.unit.name
        raise UnsupportedError(
            f"the registry has no settings of {name} that can be read and written back"
        )
    for table in tables:
        try:
            settings[table.name] = _read(endpoint, table, timeout)
        except ReplyTimeoutError as error:
            _log.warning("%s: not in the snapshot: %s: %s", endpoint.name, table.name, error)
    return {"unit": endpoint.connection.unit.name, "settings": settings}


def restore(
    endpoint: Endpoint, taken: Mapping[str, Any], timeout: float | None, *, tuning: bool
) -> tuple[str, ...]:
    """Write the sets of a snapshot that differ from those of the controller, and return their names.

    All of them are checked before the first is written.

    :param tuning: whether control loops and the drive of motors are also written.

    Raise :class:`~stagewire.errors.BadValueError` for anything but a snapshot of the same unit.
    """
    what = f"{endpoint.name}: restore"
    settings = _settings(endpoint, what, taken)
    tables = {table.name: table for table in _tables(endpoint)}
    if strange := sorted(settings.keys() - tables.keys()):
        raise BadValueError(f"{what}: unknown settings {', '.join(strange)}; nothing was written")
    effects = ("settings", _TUNING) if tuning else ("settings",)
    changed: list[tuple[ParameterSet[Any], dict[str, Any]]] = []
    for name, wanted in settings.items():
        if not isinstance(wanted, Mapping):
            raise BadValueError(f"{what}: {name} must be a mapping, not {wanted!r:.80}")
        if tables[name].effect in effects:
            held = _read(endpoint, tables[name], timeout)
            new = {key: value for key, value in wanted.items() if held.get(key) != value}
            _check(endpoint, f"{what}: {name}", tables[name], new, held)
            if new:
                changed.append((tables[name], new))
    for table, new in changed:
        change(endpoint, table, timeout, new)
    return tuple(table.name for table, _ in changed)


def _read(endpoint: Endpoint, table: ParameterSet[Any], timeout: float | None) -> dict[str, Any]:
    """Return what the controller holds, by the keywords of the ``set_`` method."""
    read = (query(endpoint, table, timeout, {})).message
    there = read.layout.fields
    raw = [(entry, getattr(read, entry.field)) for entry in table.given if entry.field in there]
    return {e.keyword: number_of(value, e.real) if e.real else value for e, value in raw}


def _check(
    endpoint: Endpoint,
    what: str,
    table: ParameterSet[Any],
    new: Mapping[str, Any],
    held: Mapping[str, Any],
) -> None:
    """Raise an error for a keyword that a set does not have, and for a value that cannot be written."""
    if strange := sorted(new.keys() - {entry.keyword for entry in table.given}):
        raise BadValueError(f"{what} has no {', '.join(strange)}; nothing was written")
    assert table.set is not None  # `_tables` yields no others
    if new:
        fields = fields_of(what, table.given, new, endpoint.scales(), of=table.set, some=True)
        check_limits(endpoint, what, table.given, fields)
        known = {e.field: held[e.keyword] for e in table.given if e.keyword in held and not e.real}
        check_rating(endpoint, what, table.set, table.given, fields, known)


def _settings(
    endpoint: Endpoint, what: str, taken: Mapping[str, Any]
) -> Mapping[str, Mapping[str, Any]]:
    unit = endpoint.connection.unit.name
    if not isinstance(taken, Mapping) or not isinstance(taken.get("settings"), Mapping):
        raise BadValueError(f"{what}: this is not a snapshot: {taken!r:.80}; nothing was written")
    if taken.get("unit") != unit:
        raise BadValueError(
            f"{what}: the snapshot is of a {taken.get('unit')}, not of a {unit}; nothing was written"
        )
    settings: Mapping[str, Mapping[str, Any]] = taken["settings"]
    return settings


def _tables(endpoint: Endpoint) -> Iterator[ParameterSet[Any]]:
    """Yield the sets of a unit that can be read and written without further arguments.

    Counters are left out: writing them would move the zero of all positions.
    """
    messages = endpoint.connection.unit.messages
    for name, table in endpoint.connection.facts.writers().items():
        if (
            name in messages
            and table.req is not None
            and table.req.layout.message in messages
            and not table.asked
            and not table.motherboard
            and table.effect != "counter"
        ):
            yield table

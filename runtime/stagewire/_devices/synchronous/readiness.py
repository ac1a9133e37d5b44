# Generated from _devices/asynchronous/readiness.py by `python tools/unasync.py`; do not edit.

"""Reads the state that a motion needs, refuses a motion that cannot succeed, and enables channels."""

from __future__ import annotations

import logging

from stagewire._codec.message import Message
from stagewire._devices.endpoint import Deadline
from stagewire._devices.readiness import Switch, advice, faults_in, needs_of, switch_of
from stagewire._devices.synchronous.calls import query, set_all, write
from stagewire._devices.synchronous.targets import refuse_second
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.unit import Need
from stagewire.errors import NotReadyError, ReplyTimeoutError, UnsupportedError

_log = logging.getLogger("stagewire")


def read_state(endpoint: Endpoint) -> bool:
    """Read the state that the motions of a channel need, and log what prevents them.

    Return whether the controller answered.
    """
    connection = endpoint.connection
    try:
        for need in needs_of(connection.unit):
            query(endpoint, need.table, None, {})
    except ReplyTimeoutError as error:
        _log.warning("%s: whether it can move is unknown: %s", connection.url, error)
        return False
    for name, faults in connection.readiness.faults(endpoint.place).items():
        _log.warning(
            "%s: %s: motions will be refused: %s; %s",
            connection.url,
            endpoint.name,
            "; ".join(faults),
            advise(endpoint, name, faults),
        )
    return True


def check_ready(endpoint: Endpoint, what: str, message: type[Message], deadline: Deadline) -> None:
    """Raise :class:`~stagewire.errors.NotReadyError` if a motion cannot succeed; nothing moves.

    Parameters that the registry wants to be read each time are read, and so is a state that was bad when it
    was last known.

    :param message: class of the message that starts the motion.
    """
    readiness = endpoint.connection.readiness
    for need in endpoint.connection.unit.needs.get(message, ()):
        if need.each_time or readiness.known_to_fail(endpoint.place, need):
            refuse_second(endpoint, what, deadline)
            read = (query(endpoint, need.table, endpoint.part_of(deadline), {})).message
            _refuse(endpoint, what, need, read)


def request_ends(endpoint: Endpoint, what: str, deadline: Deadline) -> None:
    """Write back the parameters that a controller must receive before it reports the end of a motion.

    Some units need this once on each connection. The values are those that the controller holds.

    Raise :class:`~stagewire.errors.NotReadyError` for values that cannot work, which are not written.
    """
    connection = endpoint.connection
    table = connection.unit.reports_ends_after
    if table is None or connection.reports_ends(endpoint.address):
        return
    refuse_second(endpoint, what, deadline)
    with endpoint.transport.lock((*endpoint.place, table.name), what, deadline.left):
        read = (query(endpoint, table, endpoint.part_of(deadline), {})).message
        for need in needs_of(connection.unit):
            if need.table is table:
                _refuse(endpoint, f"{what} (whose end it would not report)", need, read)
        cls = table.written_with(read)
        assert cls is not None  # the registry names a set that is written
        write(endpoint, table, endpoint.message(cls, _fields(cls, read)), deadline)


def _fields(cls: type[Message], read: Message) -> dict[str, object]:
    """Return the values of a reply that a message writes back."""
    return {name: value for name, value in read.values().items() if name in cls.layout.fields}


def advise(endpoint: Endpoint, name: str, faults: tuple[str, ...]) -> str:
    """Return what a user can do about faults in a parameter set of a channel."""
    connection = endpoint.connection
    limits = connection.stated_limits(endpoint.place)
    return advice(connection.unit, name, faults, endpoint.scales(), limits)


def _refuse(endpoint: Endpoint, what: str, need: Need, read: Message) -> None:
    faults = faults_in(endpoint.connection.unit, need, read)
    if faults:
        raise NotReadyError(
            f"{what} was not sent, because it cannot succeed: {'; '.join(faults)} "
            f"({read.layout.message}). {advise(endpoint, need.table.name, faults)}",
            faults,
        )


def is_enabled(endpoint: Endpoint, timeout: float | None) -> bool:
    """Ask whether a channel is enabled."""
    switch = _switch(endpoint)
    values = query(endpoint, switch.table, timeout, {})
    enabled: bool = getattr(values.message, switch.field) == switch.on
    return enabled


def switch_channel(endpoint: Endpoint, timeout: float | None, *, on: bool) -> None:
    """Enable or disable a channel, and read the state back.

    Raise :class:`~stagewire.errors.NotReadyError` if the controller still reports the other state.
    """
    switch = _switch(endpoint)
    [entry] = [entry for entry in switch.table.given if entry.field == switch.field]
    set_all(endpoint, switch.table, timeout, {entry.keyword: switch.on if on else switch.off})
    if is_enabled(endpoint, timeout) is not on:
        wanted, found = ("enabled", "disabled") if on else ("disabled", "enabled")
        raise NotReadyError(
            f"{endpoint.name}: the channel was to be {wanted}, but the controller reports it as {found}",
            (f"the channel is {found}",),
        )


def _switch(endpoint: Endpoint) -> Switch:
    switch = switch_of(endpoint.connection.unit)
    if switch is None:
        raise UnsupportedError(
            f"a {endpoint.connection.unit.name} has no motor channel that can be enabled or disabled"
        )
    return switch

# Generated from _devices/asynchronous/readiness.py by `python tools/unasync.py`; do not edit.

"""Reads the state that a motion needs, refuses a motion that cannot succeed, and enables channels."""

from __future__ import annotations

import logging
from typing import Any

from stagewire._codec.message import Message
from stagewire._devices.endpoint import Deadline
from stagewire._devices.motions import Running
from stagewire._devices.readiness import (
    Switch,
    advice,
    faults_in,
    needs_at_open,
    needs_of,
    switch_of,
)
from stagewire._devices.synchronous import calls
from stagewire._devices.synchronous.calls import Keywords, query, set_all, write
from stagewire._devices.synchronous.targets import refuse_second
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.tables import Command, ParameterSet
from stagewire._devices.unit import Enabling, Need
from stagewire.errors import (
    MotionUnderWayError,
    NotReadyError,
    ReplyTimeoutError,
)

_log = logging.getLogger("stagewire")


def read_state(endpoint: Endpoint) -> bool:
    """Read the state that the motions of a channel need, and log what prevents them.

    Return whether the controller answered.
    """
    connection = endpoint.connection
    try:
        for need in needs_at_open(connection.unit):
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
    _check_enabled(endpoint, what, message, deadline)
    readiness = endpoint.connection.readiness
    for need in endpoint.connection.unit.needs.get(message, ()):
        if need.each_time or readiness.known_to_fail(endpoint.place, need):
            refuse_second(endpoint, what, deadline)
            read = (query(endpoint, need.table, endpoint.part_of(deadline), {})).message
            _refuse(endpoint, what, need, read)


def tell(endpoint: Endpoint, table: Command, timeout: float | None, given: Keywords) -> None:
    """Send a message that has no reply, if the controller is in the state that it needs.

    Raise :class:`~stagewire.errors.NotReadyError` otherwise; nothing is sent.
    """
    needs = endpoint.connection.unit.needs.get(table.message, ())
    if not needs:
        calls.tell(endpoint, table, timeout, given)
        return
    deadline = endpoint.deadline(endpoint.seconds(timeout))
    what = f"{endpoint.name}: {table.name}"
    for need in needs:
        read = (query(endpoint, need.table, deadline.left, {})).message
        _refuse(endpoint, what, need, read)
    calls.tell(endpoint, table, deadline.left, given)


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
            f"({read.layout.message}){_remedy(endpoint, need, faults)}",
            faults,
        )


def _check_enabled(
    endpoint: Endpoint, what: str, message: type[Message], deadline: Deadline
) -> None:
    """Check that a channel is enabled, on a unit that does not enable channels one by one.

    A channel that must be enabled again before each motion is enabled here.
    """
    enabling = endpoint.connection.unit.enabling
    if enabling is None:
        return
    refuse_second(endpoint, what, deadline)
    if enabling.before_motions:
        _enable_alone(endpoint, what, endpoint.part_of(deadline))
    elif enabling.channels:
        enabled = _enabled_channels(endpoint, enabling, endpoint.part_of(deadline))
        if _number(endpoint) not in enabled:
            cause = "the channel is not enabled"
            others = f"; it is {_listed(enabled)} that can move" if enabled else ""
            assert enabling.table is not None  # it has the channels
            assert enabling.table.get is not None  # it was read
            raise NotReadyError(
                f"{what} was not sent, because it cannot succeed: {cause}{others} "
                f"({enabling.table.get.layout.message}); call enable(), which disables the other channels",
                (cause,),
            )
    elif (other := _other_motion(endpoint)) is not None and not is_enabled(
        endpoint, endpoint.part_of(deadline)
    ):
        raise _busy(what, other)


def _enabled_channels(
    endpoint: Endpoint, enabling: Enabling, timeout: float | None
) -> tuple[int, ...]:
    """Ask which channels of the controller are enabled; a value without a name enables none."""
    assert enabling.table is not None  # it has the channels
    values = query(endpoint, enabling.table, timeout, {})
    return enabling.channels.get(getattr(values.message, enabling.field), ())


def _enable_alone(endpoint: Endpoint, what: str, timeout: float | None) -> None:
    """Enable a channel for its next motion, and do not read its state back."""
    if (other := _other_motion(endpoint)) is not None:
        raise _busy(what, other)
    _write_switch(endpoint, _switch(endpoint), timeout, on=True)


def _other_motion(endpoint: Endpoint) -> Running | None:
    """Return the motion of another channel of the controller that may be under way."""
    connection = endpoint.connection
    for place in connection.places:
        if place[0] == endpoint.address and place != endpoint.place:
            running = connection.motions.at(place)
            if running is not None:
                return running
    return None


def _busy(what: str, other: Running) -> MotionUnderWayError:
    return MotionUnderWayError(
        f"{what} was not sent: {other.what} is or may be under way, and enabling this channel disables the "
        "channel that moves; wait for its end, or stop it first"
    )


def _number(endpoint: Endpoint) -> int:
    """Return the number of a channel, counted from 1."""
    assert endpoint.channel is not None  # motions are those of a channel
    return endpoint.connection.unit.channel_number(endpoint.channel)


def _listed(channels: tuple[int, ...]) -> str:
    word = "channel" if len(channels) == 1 else "channels"
    return f"{word} {' and '.join(map(str, channels))}"


def _remedy(endpoint: Endpoint, need: Need, faults: tuple[str, ...]) -> str:
    """Return what a user can do about faults, as the end of an error message."""
    if need.table.set is None:
        return ". Change that at the controller, then call it again"
    return f"; {advise(endpoint, need.table.name, faults)}"


def is_enabled(endpoint: Endpoint, timeout: float | None) -> bool:
    """Ask whether a channel is enabled."""
    enabling = endpoint.connection.unit.enabling
    if enabling is not None and enabling.channels:
        return _number(endpoint) in _enabled_channels(endpoint, enabling, timeout)
    switch = _switch(endpoint)
    values = query(endpoint, switch.table, timeout, {})
    enabled: bool = getattr(values.message, switch.field) == switch.on
    return enabled


def switch_channel(endpoint: Endpoint, timeout: float | None, *, on: bool) -> None:
    """Enable or disable a channel, and read the state back.

    Raise :class:`~stagewire.errors.NotReadyError` if the controller still reports the other state.
    """
    enabling = endpoint.connection.unit.enabling
    if enabling is not None and (enabling.disables_others or enabling.channels):
        other = _other_motion(endpoint) if on else None
        if other is not None:
            raise _busy(f"{endpoint.name}: enable", other)
    if enabling is not None and enabling.channels:
        _switch_of_all(endpoint, enabling, timeout, on=on)
    else:
        _write_switch(endpoint, _switch(endpoint), timeout, on=on)
    if is_enabled(endpoint, timeout) is not on:
        wanted, found = ("enabled", "disabled") if on else ("disabled", "enabled")
        raise NotReadyError(
            f"{endpoint.name}: the channel was to be {wanted}, but the controller reports it as {found}",
            (f"the channel is {found}",),
        )


def _switch_of_all(
    endpoint: Endpoint, enabling: Enabling, timeout: float | None, *, on: bool
) -> None:
    """Enable only this channel, or disable it and leave the others as they are."""
    assert enabling.table is not None  # it has the channels
    number = _number(endpoint)
    channels: tuple[int, ...] = (number,)
    if not on:
        enabled = _enabled_channels(endpoint, enabling, timeout)
        channels = tuple(one for one in enabled if one != number)
    given = {_keyword(enabling.table, enabling.field): enabling.value_for(channels)}
    set_all(endpoint, enabling.table, timeout, given)


def _write_switch(endpoint: Endpoint, switch: Switch, timeout: float | None, *, on: bool) -> None:
    given = {_keyword(switch.table, switch.field): switch.on if on else switch.off}
    set_all(endpoint, switch.table, timeout, given)


def _keyword(table: ParameterSet[Any], field: str) -> str:
    [keyword] = [entry.keyword for entry in table.given if entry.field == field]
    return keyword


def _switch(endpoint: Endpoint) -> Switch:
    switch = switch_of(endpoint.connection.unit)
    assert (
        switch is not None
    )  # check_enabling() ensures it, and so do motions that need an enabled channel
    return switch

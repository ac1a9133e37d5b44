"""The first requests to a controller on a new line, and the stops before it is left."""

from __future__ import annotations

import logging
from contextlib import suppress
from typing import Any, Final

from stagewire._devices.asynchronous.calls import query
from stagewire._devices.asynchronous.readiness import read_state
from stagewire._devices.asynchronous.transport import (
    Endpoint,
    FramedTransport,
    Transport,
)
from stagewire._devices.connection import Connection
from stagewire._devices.identity import check_identity, firmware_of, unanswered
from stagewire._devices.tables import ParameterSet, Query
from stagewire._devices.unit import framed
from stagewire._devices.values import Values
from stagewire.errors import ReplyTimeoutError, StagewireError, TurnedAwayError

_log = logging.getLogger("stagewire")

_OCCUPIED: Final = 1
"""State of a bay of a rack that holds a card."""


async def greet(
    connection: Connection[Transport], own: Endpoint, transport: FramedTransport
) -> None:
    """Begin a conversation with a controller. Nothing moves, and no setting changes.

    But outputs that can burn or heat are switched off, unless ``on_close`` is ``leave``.

    Unless ``identify`` is False, request the identity and the settings that scales depend on.

    Raise :class:`~stagewire.errors.WrongUnitError` for a controller other than the named one,
    :class:`~stagewire.errors.ReplyTimeoutError` if it does not answer, and
    :class:`~stagewire.errors.LinkOpenError` if it closes the connection.
    """
    connection.transport = transport
    await wait_for_timeouts(connection)
    unit, choices = connection.unit, connection.choices
    _set_contexts(connection, transport)
    if choices.usb and unit.keep_alive is not None:
        transport.keep_alive(
            unit.keep_alive(), unit.bays if unit.kind == "rack" else (own.address,)
        )
    identity = connection.facts.identity
    if not choices.identify or identity is None:
        await switch_off(connection, own)
        return
    try:
        info = await query(own, identity, None, {})
    except TurnedAwayError as error:
        raise TurnedAwayError(f"{error.line}. Only the identity request was sent") from None
    except ReplyTimeoutError as error:
        raise ReplyTimeoutError(unanswered(connection, error)) from None
    check_identity(connection, info)
    _set_contexts(connection, transport)
    await switch_off(connection, own)
    await _ask_stages_and_settings(connection, own, info)


def _set_contexts(connection: Connection[Transport], transport: FramedTransport) -> None:
    """Set the contexts that select layouts; some depend on the firmware that the controller reports."""
    contexts = connection.unit.contexts_of(firmware_of(connection.info))
    connection.contexts = contexts
    if contexts:
        # Some controllers answer from address 0, or with source and destination swapped.
        for address in (*connection.addresses, 0, framed(connection.facts).host):
            transport.tell(address, **contexts)


async def wait_for_timeouts(connection: Connection[Transport]) -> None:
    """Wait until the controller has discarded a message that was cut off when the line was lost.

    Otherwise the first bytes on the new line would complete that message, for example the target of a move.
    """
    if connection.broken_at is not None:
        transport, pause = connection.transport, connection.choices.reconnect_pause
        left = connection.broken_at + pause - transport.now()
        if left > 0:
            await transport.pause(min(left, pause))


async def _ask_stages_and_settings(
    connection: Connection[Transport], own: Endpoint, info: Values[Any]
) -> None:
    """Request from every channel its stage, the settings of its scales, and the state that motions need."""
    tables, unit = _tables(connection), connection.unit
    reports = unit.reports_stage
    if not tables and reports is None and not unit.needs:
        return
    silent: set[int] = set()
    for place in connection.places:
        bay = unit.bays.index(place[0]) if unit.kind == "rack" else None  # 0-based on the wire
        if bay is not None and await _is_empty(connection, own, bay):
            continue
        number = unit.channel_number(place[1]) if place[1] is not None else 1
        endpoint = Endpoint(connection, *place, f"{unit.name} channel {number}")
        if reports is not None:
            told = info if reports.message == info.message.layout.message else None
            told = told or await _answer(endpoint, reports.query, "the stage")
            if told is not None:
                connection.reported_stage(place, reports.id_in(told.message))
        for table in tables:
            if reports is None or table.req is not reports.query.req:  # asked above
                await _answer(endpoint, table, "a setting")
        if unit.needs and place[0] not in silent and not await read_state(endpoint):
            silent.add(place[0])
    if reports is not None:
        connection.stages_reported()


async def _answer(
    endpoint: Endpoint, table: ParameterSet[Any] | Query[Any], what: str
) -> Values[Any] | None:
    """Return the answer to a request; None, with a warning, if there is none."""
    try:
        answer: Values[Any] = await query(endpoint, table, None, {})
    except ReplyTimeoutError as error:
        _log.warning("%s: %s is unknown: %s", endpoint.connection.url, what, error)
        return None
    return answer


async def switch_off(connection: Connection[Transport], own: Endpoint) -> None:
    """Switch off the outputs that can burn or heat, unless ``on_close`` is ``leave``.

    Raise :class:`~stagewire.errors.ReplyTimeoutError` if the values that the messages keep cannot be read.
    """
    orders, outputs = connection.unit.safe_state, connection.outputs
    if not orders or not connection.choices.stop_on_close:
        return
    transport, seconds = connection.transport, connection.choices.timeout
    assert isinstance(transport, FramedTransport)
    for address in dict.fromkeys(address for address, _ in connection.places):
        for order in outputs.unread(orders, address):
            assert order.read is not None  # a lint rule ensures it
            endpoint = Endpoint(connection, address, own.channel, own.name)
            try:
                await query(endpoint, order.read, None, {})
            except ReplyTimeoutError as error:
                raise ReplyTimeoutError(
                    f"{error}. The outputs of the {connection.unit.name} were not switched off, because "
                    f'{order.message.layout.message} needs this reply; on_close="leave" leaves them alone'
                ) from None
    for address, message in outputs.messages(orders, connection.places):
        await transport.halt(message, None, address, seconds)
    for place in connection.places:
        connection.motions.stopped(place)


async def leave(connection: Connection[Transport]) -> None:
    """Stop the motions of a device whose line others still use, unless ``on_close`` is ``leave``.

    Then stop the updates that it has started. Its connection is that of the others, and is not ended.
    """
    transport, choices = connection.transport, connection.choices
    assert isinstance(transport, FramedTransport)
    off = connection.outputs.messages(connection.unit.safe_state, connection.places)
    for address, halt in [*off, *connection.motions.halts()] if choices.stop_on_close else ():
        with suppress(StagewireError):  # the others are still stopped
            await transport.halt(halt, None, address, choices.timeout)
    for address, ending in connection.updating:
        with suppress(StagewireError):
            await transport.send(ending(), address, choices.timeout)
    with suppress(StagewireError):  # the line may be closed
        transport.keep_alive(None, connection.addresses)


def _tables(connection: Connection[Transport]) -> list[Query[Any]]:
    """Return a query for each message that reports settings and can be requested."""
    asked = {
        told.req: Query(told.req.layout.message, Values, told.req, (told.get,))
        for _, told in connection.facts.telling(connection.unit)
        if told.req is not None
        and told.get is not None
        and told.req.layout.message in connection.unit.messages
    }
    return list(asked.values())


async def _is_empty(connection: Connection[Transport], own: Endpoint, bay: int) -> bool:
    """Ask the motherboard of a rack whether a bay, counted from 0, is empty."""
    table = connection.facts.bay_used
    if (
        table is None
        or table.req is None
        or table.req.layout.message not in connection.unit.messages
    ):
        return False
    values = await query(own, table, None, {table.asked[0].keyword: bay})
    return bool(getattr(values.message, "bay_state", _OCCUPIED) != _OCCUPIED)

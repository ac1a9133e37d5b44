"""What a call does, once for threads and asyncio alike: from the keywords of a user to values.

Each is a coroutine that waits for the line of its spot, and for nothing else. What moves is in
:mod:`stagewire._devices.moving`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias, TypeVar

from stagewire._codec.message import Message
from stagewire._devices.giving import check_held, fields_of
from stagewire._devices.line import Deadline
from stagewire._devices.motions import Running
from stagewire._devices.spot import Spot
from stagewire._devices.tables import Action, Command, Given, ParameterSet, Query
from stagewire._devices.values import Values
from stagewire.errors import (
    MotionUnderWayError,
    OutOfRangeError,
    ReplyTimeoutError,
    StagewireError,
    TransportLostError,
    UnsupportedError,
)

__all__ = [
    "Keywords",
    "ask",
    "change",
    "check_limits",
    "is_moving",
    "look",
    "moves",
    "send_starting",
    "set_all",
    "tell",
]

V = TypeVar("V", bound=Values[Any])

Keywords: TypeAlias = Mapping[str, object]


async def ask(
    spot: Spot,
    table: ParameterSet[V] | Query[V],
    timeout: float | None,
    given: Keywords,
) -> V:
    """Ask for values and return them."""
    return await _ask(spot, table, spot.seconds(timeout), given)


async def look(spot: Spot, table: ParameterSet[V] | Query[V], seconds: float) -> V:
    """Ask for values on the library's own account: what they show settles no motion."""
    message, replies = _question(spot, table, {})
    reply = await spot.line.ask(message, replies, spot.address_of(table), seconds)
    spot.connection.learn(spot.address, spot.channel, reply)
    return table.values(reply, spot.scales())


async def _ask(spot: Spot, table: ParameterSet[V] | Query[V], seconds: float, given: Keywords) -> V:
    message, replies = _question(spot, table, given)
    address, deadline = spot.address_of(table), Deadline(spot.line, seconds)
    reply = await spot.line.ask(message, replies, address, seconds)
    running = _shown_at_rest(spot, reply)
    if running is not None and reply.layout.unsolicited:
        try:
            await _wait_for_what_is_late(spot, deadline)
            reply = await spot.line.ask(message, replies, address, deadline.left)
            running = _shown_at_rest(spot, reply)
        except ReplyTimeoutError:  # the status is an answer, but no proof
            running = None
    if running is not None and _settled(spot, running):
        await spot.frames.settled(spot.address, spot.channel)
    spot.connection.learn(spot.address, spot.channel, reply)
    return table.values(reply, spot.scales())


def _question(
    spot: Spot, table: ParameterSet[Any] | Query[Any], given: Keywords
) -> tuple[Message, tuple[type[Message], ...]]:
    """Return the message that asks, and those that answer it."""
    fields: dict[str, Any] = {}
    if table.asked:
        fields = fields_of(f"{spot.name}: get_{table.name}", table.asked, given, spot.scales())
    req, replies = _request_of(table)
    return spot.message(req, fields), replies


def _request_of(
    table: ParameterSet[Any] | Query[Any],
) -> tuple[type[Message], tuple[type[Message], ...]]:
    """Return the class of the message that asks, and those that answer it."""
    if isinstance(table, Query):
        return table.req, table.gets
    assert table.req is not None  # else there is no such method
    assert table.get is not None
    return table.req, (table.get,)


def _shown_at_rest(spot: Spot, message: Message) -> Running | None:
    """Return the motion whose end is not known, if a status shows that nothing moves.

    Not one that was begun a moment ago: a controller may say that nothing moves when it is about to begin.
    """
    moving = spot.connection.unit.moving.get(type(message))
    if moving is None or moves(message, moving):
        return None
    running = spot.connection.motions.at(spot.place)
    if running is None or running.just_begun(spot.line.now()):
        return None
    return running


async def _wait_for_what_is_late(spot: Spot, deadline: Deadline) -> None:
    """Ask a question whose answer never comes unsolicited, and wait for it.

    An unsolicited status that was sent before the motion began may be held up on the line, and nothing
    distinguishes it from the answer to a request. A line keeps the order of what it carries, so a status that
    comes after this answer was sent after the motion began.
    """
    identity = spot.connection.facts.identity
    if identity is not None:
        req, replies = _request_of(identity)
        await spot.line.ask(req(), replies, spot.address_of(identity), deadline.left)


def _settled(spot: Spot, running: Running) -> bool:
    """Note that a motion is over, and return True, unless a call still waits for its end."""
    if running.exchange is not None and not running.exchange.done:
        return False
    spot.connection.motions.over(spot.place, running)
    return True


def moves(message: Message, moving: tuple[str, int]) -> bool:
    """Say whether a status has a bit that means motion."""
    field, mask = moving
    return bool(getattr(message, field) & mask)


async def set_all(
    spot: Spot, table: ParameterSet[Any], timeout: float | None, given: Keywords
) -> None:
    """Write a whole set of parameters: one message."""
    what = f"{spot.name}: set_{table.name}"
    fields = fields_of(what, table.given, given, spot.scales())
    message = _message(spot, what, table, fields)
    deadline = Deadline(spot.line, spot.seconds(timeout))
    async with spot.lock(table.name, what, deadline.left):
        await _write(spot, table, message, deadline)


async def change(spot: Spot, table: ParameterSet[V], timeout: float | None, given: Keywords) -> V:
    """Read a set of parameters, change some, and write all of them, while nobody else here does.

    Returns what was written. Raises :class:`~stagewire.errors.OutOfRangeError` where the controller holds a
    value that cannot be written back: one out of range, or one that a complete enumeration does not list; and
    :class:`~stagewire.errors.LimitError` for one above a limit of the stage.
    """
    what = f"{spot.name}: change_{table.name}"
    new = fields_of(what, table.given, given, spot.scales(), some=True)
    check_limits(spot, what, table.given, new)
    deadline = Deadline(spot.line, spot.seconds(timeout))
    async with spot.lock(table.name, what, deadline.left):
        read = (await _ask(spot, table, deadline.left, {})).message
        held = {entry.field: getattr(read, entry.field) for entry in table.given}
        try:
            for entry in table.given:
                if entry.field not in new:
                    check_held(entry, held[entry.field])
            message = _message(spot, what, table, {**held, **new})
        except OutOfRangeError as error:
            raise type(error)(
                f"{what}: the controller holds a value that cannot be written back: {error}; nothing was "
                f"written. Pass this value as well, or write all values with set_{table.name}"
            ) from None
        await _write(spot, table, message, deadline)
    return table.values(type(read).keep({**read.values(), **new}), spot.scales())


def _message(spot: Spot, what: str, table: ParameterSet[Any], fields: dict[str, Any]) -> Message:
    """Return what writes the set, if all of it may be written."""
    assert table.set is not None  # else there is no such method
    check_limits(spot, what, table.given, fields)
    return spot.message(table.set, fields)


def check_limits(
    spot: Spot, what: str, entries: tuple[Given, ...], fields: Mapping[str, Any]
) -> None:
    """Raise :class:`~stagewire.errors.LimitError` for values that exceed the limits of the stage."""
    spot.connection.limits(spot.place).check(what, entries, fields, spot.scales())


async def _write(
    spot: Spot, table: ParameterSet[Any], message: Message, deadline: Deadline
) -> None:
    await spot.line.send(message, spot.address_of(table), deadline.left)
    spot.connection.learn(spot.address, spot.channel, message)


async def tell(spot: Spot, table: Command, timeout: float | None, given: Keywords) -> None:
    """Send what nothing answers."""
    what = f"{spot.name}: {table.name}"
    fields = fields_of(what, table.given, given, spot.scales())
    check_limits(spot, what, table.given, fields)
    message = spot.message(table.message, fields)
    seconds = spot.seconds(timeout)
    running = spot.running(table, what)
    if running is None:
        await spot.line.send(message, spot.address_of(table), seconds)
    else:
        await send_starting(spot, table, message, running, seconds)
    spot.connection.sent(spot.address, table)
    spot.connection.learn(spot.address, spot.channel, message)


async def send_starting(
    spot: Spot, table: Action | Command, message: Message, running: Running, seconds: float
) -> None:
    """Send what starts something whose end nothing tells."""
    motions, place = spot.connection.motions, spot.place
    await refuse_left(spot, running.what, seconds)
    before = motions.at(place)
    motions.start(place, running)  # before it is sent: it is to be stopped if all ends meanwhile
    try:
        await spot.line.send(message, spot.address_of(table), seconds)
    except TransportLostError:
        raise  # nobody knows whether it was sent
    except StagewireError:
        motions.refused(place, running, before)
        raise


async def refuse_left(spot: Spot, what: str, seconds: float) -> None:
    """Raise where something that was started over an earlier line may still move; the status decides.

    Raises :class:`~stagewire.errors.MotionUnderWayError`.
    """
    motions, unit = spot.connection.motions, spot.connection.unit
    running = motions.at(spot.place)
    if running is None or not running.left:
        return
    if unit.idle is not None or (unit.status_query is not None and unit.moving):
        await is_moving(spot, min(seconds, spot.seconds(None)))
        if motions.at(spot.place) is not running:
            return
    raise MotionUnderWayError(
        f"{what} was not sent: {running.what} was under way when its line was lost or closed, and may still "
        "be; stop it, or wait until is_moving() says that nothing moves"
    )


async def is_moving(spot: Spot, timeout: float | None) -> bool:
    """Ask whether anything moves there.

    Where a status shows no motion although the end of one is not known, it is asked for again after what may
    be late on the line has come.

    Raises :class:`~stagewire.errors.UnsupportedError` for a unit that has no message for it.
    """
    unit = spot.connection.unit
    seconds = spot.seconds(timeout)
    if unit.idle is not None:
        reply = await spot.line.ask(unit.idle.read(), (unit.idle.reply,), spot.address, seconds)
        busy = bool(getattr(reply, unit.idle.field) != unit.idle.value)
        running = spot.connection.motions.at(spot.place)
        if not busy and running is not None and not running.just_begun(spot.line.now()):
            _settled(spot, running)
        return busy
    if unit.status_query is None or not unit.moving:
        raise UnsupportedError(f"{unit.name} has no message that asks whether it moves")
    status = (await _ask(spot, unit.status_query, seconds, {})).message
    if moves(status, unit.moving[type(status)]):
        return True
    running = spot.connection.motions.at(spot.place)
    return running is not None and running.just_begun(spot.line.now())

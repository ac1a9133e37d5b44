"""Calls that read and write values: keywords become messages, and replies become values.

Each call waits only for the transport of its endpoint. Calls that move something are in
:mod:`stagewire._devices.asynchronous.motion`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias, TypeVar

from stagewire._codec.message import Message
from stagewire._devices.arguments import check_held, fields_of
from stagewire._devices.asynchronous.transport import Endpoint, framed_transport
from stagewire._devices.endpoint import Deadline
from stagewire._devices.motions import Running
from stagewire._devices.tables import Action, Command, Given, ParameterSet, Query
from stagewire._devices.unit import Unit
from stagewire._devices.values import Values
from stagewire.errors import (
    MotionUnderWayError,
    NotReadyError,
    OutOfRangeError,
    ReplyTimeoutError,
    StagewireError,
    TransportLostError,
    UnknownFieldError,
    UnsupportedError,
)

V = TypeVar("V", bound=Values[Any])

Keywords: TypeAlias = Mapping[str, object]


async def query(
    endpoint: Endpoint,
    table: ParameterSet[V] | Query[V],
    timeout: float | None,
    given: Keywords,
) -> V:
    """Request values and return them."""
    return await _ask(endpoint, table, endpoint.seconds(timeout), given)


async def look(endpoint: Endpoint, table: ParameterSet[V] | Query[V], seconds: float) -> V:
    """Request values for the library itself; unlike :func:`query`, never mark a motion as ended."""
    message, replies = _question(endpoint, table, {})
    reply = await endpoint.transport.ask(message, replies, endpoint.address_of(table), seconds)
    endpoint.connection.learn(endpoint.address, endpoint.channel, reply)
    return endpoint.connection.report(table.values, reply, endpoint.place)


async def _ask(
    endpoint: Endpoint, table: ParameterSet[V] | Query[V], seconds: float, given: Keywords
) -> V:
    message, replies = _question(endpoint, table, given)
    address, deadline = endpoint.address_of(table), endpoint.deadline(seconds)
    reply = await endpoint.transport.ask(message, replies, address, seconds)
    running = _shown_at_rest(endpoint, reply)
    if running is not None and reply.layout.unsolicited:
        try:
            await _wait_for_what_is_late(endpoint, deadline)
            reply = await endpoint.transport.ask(message, replies, address, deadline.left)
            running = _shown_at_rest(endpoint, reply)
        except ReplyTimeoutError:  # the status is a reply, but does not prove rest
            running = None
    if running is not None and _settled(endpoint, running):
        framed_transport(endpoint).settled(endpoint.address, endpoint.channel)
    endpoint.connection.learn(endpoint.address, endpoint.channel, reply)
    return endpoint.connection.report(table.values, reply, endpoint.place)


def _question(
    endpoint: Endpoint, table: ParameterSet[Any] | Query[Any], given: Keywords
) -> tuple[Message, tuple[type[Message], ...]]:
    """Return the request, and the classes of its replies."""
    req, replies = _request_of(table)
    fields: dict[str, Any] = {}
    if table.asked:
        what = f"{endpoint.name}: get_{table.name}"
        fields = fields_of(what, table.asked, given, endpoint.scales(), of=req)
    return endpoint.message(req, fields), replies


def _request_of(
    table: ParameterSet[Any] | Query[Any],
) -> tuple[type[Message], tuple[type[Message], ...]]:
    """Return the class of the request, and the classes of its replies."""
    if isinstance(table, Query):
        return table.req, table.gets
    assert table.req is not None  # otherwise the method would not exist
    assert table.get is not None
    return table.req, (table.get, *(get for get, _ in table.others))


def replies_of(table: ParameterSet[Any] | Query[Any]) -> tuple[type[Message], ...]:
    """Return the classes of the replies to a request for values."""
    return _request_of(table)[1]


def _shown_at_rest(endpoint: Endpoint, message: Message) -> Running | None:
    """Return the motion whose end is unknown, if a status shows that nothing moves.

    Return None for a motion that was only just started, because its controller may still report rest.
    """
    moving = endpoint.connection.unit.moving.get(type(message))
    if moving is None or moves(message, moving):
        return None
    running = endpoint.connection.motions.at(endpoint.place)
    if running is None or running.just_begun(endpoint.now()):
        return None
    return running


async def _wait_for_what_is_late(endpoint: Endpoint, deadline: Deadline) -> None:
    """Send a request whose reply is never unsolicited, and wait for the reply.

    An unsolicited status from before the motion may be delayed on the line, and looks like the reply to a
    request. A line preserves the order of messages, so a status that arrives after this reply was sent after
    the motion began.
    """
    identity = endpoint.connection.facts.identity
    if identity is not None:
        req, replies = _request_of(identity)
        await endpoint.transport.ask(req(), replies, endpoint.address_of(identity), deadline.left)


def _settled(endpoint: Endpoint, running: Running) -> bool:
    """Mark a motion as ended and return True, unless a call still waits for its end."""
    if running.exchange is not None and not running.exchange.done:
        return False
    endpoint.connection.motions.over(endpoint.place, running)
    return True


def moves(message: Message, moving: tuple[str, int]) -> bool:
    """Return whether a status has a bit set that indicates motion."""
    field, mask = moving
    return bool(getattr(message, field) & mask)


async def set_all(
    endpoint: Endpoint, table: ParameterSet[Any], timeout: float | None, given: Keywords
) -> None:
    """Write all parameters of a set in one message."""
    what = f"{endpoint.name}: set_{table.name}"
    writing = table.written_in(endpoint.connection.contexts)
    assert writing is not None  # otherwise the method would not exist
    there = tuple(entry for entry in table.given if entry.field in writing.layout.fields)
    used = {e.field: e for e in table.given if any(given.get(k) is not None for k in e.keywords)}
    _check_there(what, table, used, writing.layout.fields)
    fields = fields_of(what, there, given, endpoint.scales(), of=writing)
    message = _message(endpoint, what, table, fields, writing)
    check_rating(endpoint, what, table.set, table.given, fields, {})
    deadline = endpoint.deadline(endpoint.seconds(timeout))
    async with endpoint.transport.lock((*endpoint.place, table.name), what, deadline.left):
        await write(endpoint, table, message, deadline)


async def establish(
    endpoint: Endpoint,
    table: ParameterSet[Any],
    timeout: float | None,
    given: Keywords,
    *,
    causes: str,
    otherwise: Keywords,
) -> None:
    """Write the parameters of a set, and read them back.

    :param causes: why the controller may report other values, and what to do.
    :param otherwise: values that are written if it does, or if it does not answer.

    Raise :class:`~stagewire.errors.NotReadyError` if it reports other values.
    """
    deadline = endpoint.deadline(endpoint.seconds(timeout))
    await set_all(endpoint, table, deadline.left, given)
    try:
        read = await _ask(endpoint, table, deadline.left, {})
        other = {k: v for k, wanted in given.items() if (v := getattr(read, k)) != wanted}
        if other:
            reported = ", ".join(f"{key} {value.name}" for key, value in other.items())
            raise NotReadyError(
                f"{endpoint.name}: {table.name}: the controller reports {reported}. {causes}",
                (causes,),
            )
    except StagewireError:
        if otherwise:
            await set_all(endpoint, table, timeout, otherwise)
        raise


async def change(
    endpoint: Endpoint, table: ParameterSet[V], timeout: float | None, given: Keywords
) -> V:
    """Read a set of parameters, change some, and write all of them, while other calls of this program wait.

    Return the values that were written. Raise :class:`~stagewire.errors.OutOfRangeError` if the controller
    holds a value that cannot be written back, because it is out of range or missing from a complete
    enumeration. Raise :class:`~stagewire.errors.LimitError` for a value above a limit of the stage.
    """
    what = f"{endpoint.name}: change_{table.name}"
    assert table.set is not None  # otherwise the method would not exist
    new = fields_of(what, table.given, given, endpoint.scales(), of=table.set, some=True)
    check_limits(endpoint, what, table.given, new)
    asked = {entry.keyword: new[entry.field] for entry in table.asked if entry.field in new}
    deadline = endpoint.deadline(endpoint.seconds(timeout))
    async with endpoint.transport.lock((*endpoint.place, table.name), what, deadline.left):
        read = (await _ask(endpoint, table, deadline.left, asked)).message
        fields = read.layout.fields
        _check_there(what, table, new, fields)
        held = {e.field: getattr(read, e.field) for e in table.given if e.field in fields}
        try:
            for entry in table.given:
                if entry.field in held and entry.field not in new:
                    check_held(entry.on(endpoint.scales().controllers), held[entry.field])
            writing = table.written_with(read)
            message = _message(endpoint, what, table, {**held, **new}, writing)
        except OutOfRangeError as error:
            raise type(error)(
                f"{what}: the controller holds a value that cannot be written back: {error}; nothing was "
                f"written. Also pass this value, or write all values with set_{table.name}"
            ) from None
        check_rating(endpoint, what, table.set, table.given, new, held)
        await write(endpoint, table, message, deadline)
    written = type(read).keep({**read.values(), **new})
    return endpoint.connection.report(table.values, written, endpoint.place)


def _check_there(
    what: str, table: ParameterSet[Any], new: Mapping[str, Any], fields: tuple[str, ...]
) -> None:
    """Raise :class:`~stagewire.errors.UnknownFieldError` for a value that the controller does not have."""
    absent = [e.keyword for e in table.given if e.field in new and e.field not in fields]
    if absent:
        raise UnknownFieldError(
            f"{what}: this controller has this set in a shorter packet without {', '.join(absent)}; "
            "nothing was written"
        )


def _message(
    endpoint: Endpoint,
    what: str,
    table: ParameterSet[Any],
    fields: dict[str, Any],
    writing: type[Message] | None = None,
) -> Message:
    """Return the message that writes the set, after checking the limits of the stage.

    :param writing: class of the message; None: the one that the registry prefers.
    """
    cls = writing or table.set
    assert cls is not None  # otherwise the method would not exist
    check_limits(endpoint, what, table.given, fields)
    return endpoint.message(cls, fields)


def check_limits(
    endpoint: Endpoint, what: str, entries: tuple[Given, ...], fields: Mapping[str, Any]
) -> None:
    """Raise :class:`~stagewire.errors.LimitError` for values that exceed the limits of the stage."""
    endpoint.connection.limits(endpoint.place).check(what, entries, fields, endpoint.scales())


def check_rating(
    endpoint: Endpoint,
    what: str,
    message: type[Message] | None,
    entries: tuple[Given, ...],
    fields: Mapping[str, Any],
    held: Mapping[str, Any],
) -> None:
    """Raise :class:`~stagewire.errors.LimitError` for voltages above the rating of the actuator.

    :param held: values that the controller holds, as far as they are known.
    """
    rating = endpoint.connection.rating
    rating.check(what, message, entries, fields, held, endpoint.scales())


async def write(
    endpoint: Endpoint, table: ParameterSet[Any], message: Message, deadline: Deadline
) -> None:
    """Send the message that writes a set, and learn from it."""
    await endpoint.transport.send(message, endpoint.address_of(table), deadline.left)
    endpoint.connection.learn(endpoint.address, endpoint.channel, message)
    endpoint.connection.outdate(table.values, endpoint.place)


async def tell(endpoint: Endpoint, table: Command, timeout: float | None, given: Keywords) -> None:
    """Send a message that has no reply."""
    what = f"{endpoint.name}: {table.name}"
    fields = fields_of(what, table.given, given, endpoint.scales(), of=table.message)
    check_limits(endpoint, what, table.given, fields)
    check_rating(endpoint, what, table.message, table.given, fields, {})
    message = endpoint.message(table.message, fields)
    seconds = endpoint.seconds(timeout)
    running = endpoint.running(table, what)
    if running is None:
        await endpoint.transport.send(message, endpoint.address_of(table), seconds)
    else:
        await send_starting(endpoint, table, message, running, seconds)
    endpoint.connection.sent(endpoint.address, table)
    endpoint.connection.learn(endpoint.address, endpoint.channel, message)


async def send_starting(
    endpoint: Endpoint, table: Action | Command, message: Message, running: Running, seconds: float
) -> None:
    """Send a message that starts a motion without a reported end."""
    motions, place = endpoint.connection.motions, endpoint.place
    await refuse_left(endpoint, running.what, seconds)
    before = motions.at(place)
    motions.start(place, running)  # before sending, so that it is stopped if the program ends now
    try:
        await endpoint.transport.send(message, endpoint.address_of(table), seconds)
    except TransportLostError:
        raise  # it may have been sent
    except StagewireError:
        motions.refused(place, running, before)
        raise


async def refuse_left(endpoint: Endpoint, what: str, seconds: float) -> None:
    """Raise an error if a motion that was started over an earlier line may still be under way.

    The status is requested to find out. Raise :class:`~stagewire.errors.MotionUnderWayError`.
    """
    motions, unit = endpoint.connection.motions, endpoint.connection.unit
    running = motions.at(endpoint.place)
    if running is None or not running.left:
        return
    advice = "stop it"
    if reports_motion(unit):
        await is_moving(endpoint, min(seconds, endpoint.seconds(None)))
        if motions.at(endpoint.place) is not running:
            return
        advice += ", or wait until is_moving() returns False"
    raise MotionUnderWayError(
        f"{what} was not sent: {running.what} was under way when its line was lost or closed, and may still "
        f"be; {advice}"
    )


def reports_motion(unit: Unit) -> bool:
    """Return whether a channel of a unit can be asked whether it moves."""
    status = unit.status_query
    return unit.idle is not None or (
        status is not None and not unit.moving.keys().isdisjoint(replies_of(status))
    )


async def is_moving(endpoint: Endpoint, timeout: float | None) -> bool:
    """Return whether the controller reports motion.

    If a status shows rest while the end of a motion is unknown, wait for delayed messages and read it again.

    Raise :class:`~stagewire.errors.UnsupportedError` for a unit that has no such request.
    """
    unit = endpoint.connection.unit
    seconds = endpoint.seconds(timeout)
    if unit.idle is not None:
        reply = await endpoint.transport.ask(
            unit.idle.read(), (unit.idle.reply,), endpoint.address, seconds
        )
        busy = bool(getattr(reply, unit.idle.field) != unit.idle.value)
        running = endpoint.connection.motions.at(endpoint.place)
        if not busy and running is not None and not running.just_begun(endpoint.now()):
            _settled(endpoint, running)
        return busy
    if unit.status_query is None or not reports_motion(unit):
        raise UnsupportedError(f"a {unit.name} has no request for whether it moves")
    status = (await _ask(endpoint, unit.status_query, seconds, {})).message
    if moves(status, unit.moving[type(status)]):
        return True
    running = endpoint.connection.motions.at(endpoint.place)
    return running is not None and running.just_begun(endpoint.now())

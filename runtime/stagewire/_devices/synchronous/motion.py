# Generated from _devices/asynchronous/motion.py by `python tools/unasync.py`; do not edit.

"""Calls that start or stop motions, and the diagnosis of a motion that does not end.

A motion stays in the list of the connection until its end is known: the controller reported it, a status
showed it, or a stop was sent. After a timeout it may still be under way. It is then stopped with all others
when the device is closed, unless the user chose ``on_close="leave"``.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, TypeAlias

from stagewire._codec.message import Message
from stagewire._devices.arguments import fields_of
from stagewire._devices.endpoint import MOMENT, Deadline, defaults_of
from stagewire._devices.motions import Running
from stagewire._devices.synchronous.calls import (
    Keywords,
    look,
    query,
    refuse_left,
    send_starting,
)
from stagewire._devices.synchronous.readiness import check_ready, request_ends
from stagewire._devices.synchronous.targets import checked, targets_of
from stagewire._devices.synchronous.transport import Endpoint, framed_transport
from stagewire._devices.tables import Action, MotionEnd, Poll
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire.errors import (
    BadValueError,
    ControllerFaultError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    ReplyTimeoutError,
    StagewireError,
    TargetNotReachedError,
    UnsupportedError,
)

Unended: TypeAlias = MotionTimeoutError | ControllerFaultError
"""Errors after which a motion may still be under way."""

_SHARE: Final = 0.05
"""Fraction of the timeout of a motion that its diagnosis may take."""
_SILENT: Final = "the controller does not answer a status request either"
_POLL: Final = 0.1
"""Seconds between two polls of an axis; controllers that were polled more often have failed."""


class Started:
    """A motion that was started.

    :param endpoint: part that moves.
    :param action: table of the call.
    :param running: its entry in the list of motions.
    :param ends: messages that report its end; None if there are none.
    :param deadline: deadline for polling.
    :param targets: expected final positions in counts; empty if unknown.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        action: Action,
        running: Running,
        ends: Ends | None,
        deadline: Deadline,
        targets: tuple[int, ...],
    ) -> None:
        self.endpoint = endpoint
        self.action = action
        self.running = running
        self.ends = ends
        self._seconds = deadline.left
        self._deadline = deadline
        self._targets = targets
        self._end: MotionEnd[Any] | StagewireError | None = None

    @property
    def done(self) -> bool:
        """Whether the motion has ended or timed out, as far as is known."""
        exchange = self.running.exchange
        return self._end is not None or (exchange is not None and exchange.done)

    def wait(self, timeout: float | None) -> MotionEnd[Any]:
        """Wait for the end; see :meth:`stagewire.devices.Motion.wait`."""
        if self._end is None:
            seconds = None if timeout is None else self.endpoint.seconds(timeout)
            deadline = self._deadline if seconds is None else self.endpoint.deadline(seconds)
            end = self._wait(seconds, deadline)
            try:
                if self._targets:
                    end = checked(self.endpoint, self.running.what, self._targets, end, deadline)
                self._end = end
            except TargetNotReachedError as error:
                self._end = error
        if isinstance(self._end, StagewireError):
            raise self._end
        return self._end

    def _wait(self, seconds: float | None, deadline: Deadline) -> MotionEnd[Any]:
        running, exchange = self.running, self.running.exchange
        if exchange is not None:
            try:
                return self._ended(framed_transport(self.endpoint).wait(exchange, seconds))
            except MotionStoppedError as error:
                raise self._stopped(error) from None
            except (MotionTimeoutError, ControllerFaultError) as error:
                if error is not exchange.error or not exchange.written:
                    raise  # the exchange still waits, or was never sent
                self._end = explained(self.endpoint, error, exchange.timeout)
                raise self._end from None
        if self.action.poll is not None:
            try:
                _polled(self.endpoint, running, self.action.poll, deadline)
            except MotionTimeoutError as error:
                if not self._deadline.over:
                    raise  # the caller can wait again
                raise explained(self.endpoint, error, self._seconds) from None
            return self._ended(None)
        if self.ends is not None:
            raise _muted(running.what)
        return self._ended(None)

    def _ended(self, message: Message | None) -> MotionEnd[Any]:
        running = self.running
        ended = self.endpoint.now() if running.ended is None else running.ended
        values = (
            None
            if message is None
            else self.endpoint.connection.values_of(message, self.endpoint.place, ended)
        )
        return MotionEnd(message, values, ended - running.started)

    def _stopped(self, error: MotionStoppedError) -> MotionStoppedError:
        """Return the same error with the name of the call and values in units."""
        message = error.message
        if not isinstance(message, Message):
            return MotionStoppedError(f"{self.running.what} was stopped before it was sent")
        connection = self.endpoint.connection
        values = connection.values_of(message, self.endpoint.place)
        told = "" if values is None else values.told(connection.channel_field(type(message)))
        said = f": {told}" if told else ""
        return MotionStoppedError(f"{self.running.what} was stopped before its end{said}", message)

    def stop(self, timeout: float | None) -> MotionEnd[Any] | None:
        """Stop the motion; see :meth:`stagewire.devices.Motion.stop`."""
        table = self.endpoint.halt_of(self.action)
        if table is None or not self.running.stop:
            raise UnsupportedError(
                f"{self.running.what} cannot be stopped: the unit has no message for it"
            )
        defaults = defaults_of(table)
        given = {one.keyword: defaults[one.field] for one in table.given if one.field in defaults}
        return halt(self.endpoint, table, timeout, given)


def act(
    endpoint: Endpoint, action: Action, timeout: float | None, given: Keywords
) -> MotionEnd[Any]:
    """Start a motion and wait for its end."""
    ends = endpoint.connection.ends_of(action)
    if ends is not None and endpoint.connection.silenced(endpoint.address, ends.completed):
        raise _muted(f"{endpoint.name}: {action.name}")
    started = start(endpoint, action, timeout, given)
    return started.wait(None)


def start(endpoint: Endpoint, action: Action, timeout: float | None, given: Keywords) -> Started:
    """Start a motion, and return when its message was written to the line.

    :param timeout: seconds for the whole motion.
    """
    what = f"{endpoint.name}: {action.name}"
    seconds = endpoint.motion_seconds(timeout)
    fields = fields_of(what, action.given, given, endpoint.scales(), of=action.message)
    message = endpoint.message(action.message, fields)
    deadline = endpoint.deadline(seconds)
    orders = endpoint.connection.motions.orders(endpoint.place)
    try:
        check_ready(endpoint, what, action.message, deadline)
        targets = targets_of(endpoint, what, action, fields, deadline)
        if action.ends is not None:
            request_ends(endpoint, what, deadline)
    except ReplyTimeoutError as error:
        raise MotionTimeoutError(f"{what} was not sent: {error}") from None
    ends = endpoint.connection.ends_of(action)
    running = endpoint.running(action, what) or Running(what, b"", endpoint.now())
    started = Started(endpoint, action, running, ends, deadline, targets)
    if action.poll is not None:
        with endpoint.transport.lock((*endpoint.place, "motion"), what, deadline.left):
            _refuse_second(endpoint, what, action.poll, deadline)
            _refuse_after_stop(endpoint, what, orders)
            send_starting(endpoint, action, message, running, endpoint.part_of(deadline))
    elif ends is None or endpoint.connection.silenced(endpoint.address, ends.completed):
        _refuse_after_stop(endpoint, what, orders)
        send_starting(endpoint, action, message, running, endpoint.part_of(deadline))
    else:
        refuse_left(endpoint, running.what, deadline.left)
        _refuse_after_stop(endpoint, what, orders)
        _begin(endpoint, message, ends, deadline.left, running)
    return started


def _refuse_after_stop(endpoint: Endpoint, what: str, orders: int) -> None:
    """Raise an error if a stop was ordered since a motion was called; nothing may move after a stop."""
    if endpoint.connection.motions.orders(endpoint.place) != orders:
        raise MotionStoppedError(f"{what} was not sent, because a stop was sent in the meantime")


def _begin(
    endpoint: Endpoint, message: Message, ends: Ends, seconds: float, running: Running
) -> None:
    motions, place, now = endpoint.connection.motions, endpoint.place, endpoint.transport.now

    def ended(exchange: Exchange) -> None:
        running.ended = now()
        if not exchange.written or isinstance(exchange.error, MotionStoppedError | None):
            motions.over(place, running)

    before = motions.at(place)
    motions.start(place, running)  # before sending, so that it is stopped if the program ends now
    try:
        running.exchange = framed_transport(endpoint).begin(
            message, ends, endpoint.address, seconds, ended
        )
    except StagewireError:  # nothing was sent
        motions.refused(place, running, before)
        raise


def _refuse_second(endpoint: Endpoint, what: str, poll: Poll, deadline: Deadline) -> None:
    """Raise an error if a motion that was started here is still under way."""
    running = endpoint.connection.motions.at(endpoint.place)
    if running is None:
        return
    if _is_busy(endpoint, poll, endpoint.part_of(deadline)):
        raise MotionUnderWayError(
            f"{what} was not sent: {running.what} is still under way; wait for its end or stop it first"
        )
    endpoint.connection.motions.over(endpoint.place, running)


def _is_busy(endpoint: Endpoint, poll: Poll, seconds: float) -> bool:
    reply = endpoint.transport.ask(poll.read(), (poll.reply,), endpoint.address, seconds)
    return bool(getattr(reply, poll.field) != poll.value)


def _polled(endpoint: Endpoint, running: Running, poll: Poll, deadline: Deadline) -> None:
    """Poll until nothing moves."""
    transport = endpoint.transport
    while True:
        transport.pause(min(_POLL, deadline.left))
        if running.stopped:
            raise MotionStoppedError(f"{running.what} was stopped")
        try:
            busy = _is_busy(endpoint, poll, endpoint.part_of(deadline))
        except ReplyTimeoutError:  # a lost reply does not end the motion
            busy = True
        if running.stopped:
            raise MotionStoppedError(f"{running.what} was stopped")
        if not busy:
            running.ended = transport.now()
            endpoint.connection.motions.over(endpoint.place, running)
            return
        if deadline.over:
            raise MotionTimeoutError(
                f"{running.what}: still busy after {transport.now() - running.started:.3g} s; it may still "
                "be moving: stop it, or wait for its end again"
            )


def halt(
    endpoint: Endpoint, action: Action, timeout: float | None, given: Keywords
) -> MotionEnd[Any] | None:
    """Stop a motion; the stop is sent before all waiting messages.

    Return None if the controller does not confirm the stop. The stop is also sent if ``timeout`` is invalid.
    """
    what = f"{endpoint.name}: {action.name}"
    fields = fields_of(what, action.given, given, endpoint.scales(), of=action.message)
    message = endpoint.message(action.message, fields)
    connection, transport = endpoint.connection, endpoint.transport
    ends = connection.ends_of(action)
    if ends is not None and connection.silenced(endpoint.address, ends.completed):
        ends = None
    if isinstance(timeout, int | float) and timeout <= 0:
        timeout = MOMENT  # a stop is sent even if no time is left
    measure = endpoint.seconds if ends is None else endpoint.motion_seconds
    refused: BadValueError | None = None
    try:
        seconds = measure(timeout)
    except BadValueError as error:  # send the stop first, then raise
        ends, seconds, refused = None, endpoint.seconds(None), error
    began = transport.now()
    connection.motions.stopping(endpoint.place)
    for _ in range(connection.stops - 1):
        transport.halt(message, None, endpoint.address, seconds)
    reply = transport.halt(message, ends, endpoint.address, seconds)
    connection.motions.stopped(endpoint.place)
    if refused is not None:
        raise BadValueError(f"{refused}; the stop was sent") from refused
    if reply is None:
        return None
    return MotionEnd(reply, connection.values_of(reply, endpoint.place), transport.now() - began)


def halt_each(endpoints: Iterable[Endpoint], action: Action, timeout: float | None) -> None:
    """Send the stop of several channels, ahead of all waiting messages, and wait for no confirmation.

    Each stop is sent even if another one fails; then the first error is raised.
    """
    parts = tuple(endpoints)
    for endpoint in parts:
        endpoint.connection.motions.stopping(endpoint.place)
    failed: StagewireError | None = None
    for endpoint in parts:
        message = endpoint.message(action.message, defaults_of(action))
        try:
            seconds = endpoint.seconds(timeout)
        except BadValueError as error:  # send the stops first, then raise
            failed = BadValueError(f"{error}; the stop was sent")
            seconds = endpoint.seconds(None)
        try:
            endpoint.transport.halt(message, None, endpoint.address, seconds)
        except StagewireError as error:
            failed = failed or error
        else:
            endpoint.connection.motions.stopped(endpoint.place)
    if failed is not None:
        raise failed


def stop_outputs(endpoint: Endpoint, timeout: float | None) -> None:
    """Send the safe state and the stop state of a unit, and its stops; none of them is confirmed.

    Values that a message keeps are read first, unless they are known. The messages are also sent if
    ``timeout`` is invalid.
    """
    connection, unit = endpoint.connection, endpoint.connection.unit
    at = (endpoint.address, endpoint.channel)
    places = [at] if at in connection.places else [p for p in connection.places if p[0] == at[0]]
    refused: BadValueError | None = None
    if isinstance(timeout, int | float) and timeout <= 0:
        timeout = MOMENT  # a stop is sent even if no time is left
    try:
        seconds = endpoint.seconds(timeout)
    except BadValueError as error:  # send the stop first, then raise
        seconds, refused = endpoint.seconds(None), error
    whole = endpoint.channel is None or unit.channels == 1  # not one of several channels
    orders = (*unit.safe_state, *unit.stop_state) if whole else ()
    for place in places:
        connection.motions.stopping(place)
    for order in connection.outputs.unread(orders, endpoint.address):
        assert order.read is not None  # a lint rule ensures it
        query(endpoint, order.read, seconds, {})
    transport = framed_transport(endpoint)
    for address, message in connection.outputs.messages(orders, places):
        transport.halt(message, None, address, seconds)
    sent = {order.message for order in orders}
    for action in unit.halts:
        if action.message not in sent and _is_for(endpoint, action.message):
            halt(endpoint, action, seconds, {})
    for place in places:
        connection.motions.stopped(place)
    if refused is not None:
        raise BadValueError(f"{refused}; the stop was sent") from refused


def _is_for(endpoint: Endpoint, stop: type[Message]) -> bool:
    """Return whether a stop is for a channel, as this part is one, or for the whole controller."""
    if endpoint.connection.unit.channels == 1:
        return True
    has_channel = endpoint.connection.channel_field(stop) is not None
    return has_channel == (endpoint.channel is not None)


def _muted(what: str) -> UnsupportedError:
    return UnsupportedError(
        f"{what}: its end is not reported, because end-of-move messages are suspended; resume them, or "
        "start the motion without waiting and poll is_moving()"
    )


def explained(endpoint: Endpoint, error: Unended, seconds: float) -> Unended:
    """Return the same error with the states of the controller that may prevent a motion.

    This takes at most a twentieth of the timeout of the motion, and at most as long as any other call. After
    an unanswered request, no further request is sent. A status that shows rest does not mark the motion as
    ended. If anything goes wrong here, return the original error.

    :param seconds: timeout of the motion.
    """
    deadline = endpoint.deadline(min(seconds * _SHARE, endpoint.seconds(None)))
    known = endpoint.connection.readiness.faults(endpoint.place)
    causes = [fault for faults in known.values() for fault in faults]
    told = ""
    for table in endpoint.connection.unit.diagnosis:
        try:
            values = look(endpoint, table, deadline.left)
        except ReplyTimeoutError:
            if not told:
                return _with(error, _SILENT, ())
            break
        except StagewireError:  # the line is lost or closed
            return error
        causes += [state.cause for state in endpoint.connection.unit.hindered(values.message)]
        told = told or values.told(endpoint.connection.channel_field(type(values.message)))
    if causes:
        causes = list(dict.fromkeys(causes))  # a status may show what was known before
        return _with(error, f"likely cause: {'; '.join(causes)}", tuple(causes))
    return _with(error, f"the status shows no cause: {told}", ()) if told else error


def _with(error: Unended, note: str, causes: tuple[str, ...]) -> Unended:
    text = f"{error}; {note}"
    if isinstance(error, ControllerFaultError):
        return ControllerFaultError(text, error.code, error.fault, error.message, causes)
    return MotionTimeoutError(text, causes)

"""Calls that move something, or stop it: once for threads and asyncio alike.

What was started stays in the list of the connection until its end is known: said by the controller, seen in a
status, or brought about by a stop. After a timeout it may still move, and is stopped with everything else
when the device is closed, unless the user chose to leave it.
"""

from __future__ import annotations

from typing import Final

from stagewire._codec.message import Message
from stagewire._devices.arrival import checked
from stagewire._devices.calls import Keywords, refuse_left, send_starting
from stagewire._devices.diagnosis import explained
from stagewire._devices.giving import fields_of
from stagewire._devices.line import MOMENT, Deadline
from stagewire._devices.motions import Running
from stagewire._devices.spot import Spot, defaults_of
from stagewire._devices.tables import Action, MotionEnd, Poll
from stagewire._devices.targets import targets_of
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire.errors import (
    ControllerFaultError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    ReplyTimeoutError,
    StagewireError,
    TargetNotReachedError,
    UnsupportedError,
)

__all__ = ["Started", "act", "halt", "start"]

_POLL: Final = 0.1
"""Seconds between two questions whether an axis is busy; controllers asked more often have failed."""


class Started:
    """A motion that was started; what a handle holds.

    :param spot: where.
    :param action: what.
    :param running: its entry in the list of what is stopped at the end.
    :param ends: the messages that tell its end; None where none does.
    :param deadline: when it is given up, where it is polled for.
    :param targets: where it may end, in counts; empty where that is unknown.
    """

    def __init__(
        self,
        spot: Spot,
        action: Action,
        running: Running,
        ends: Ends | None,
        deadline: Deadline,
        targets: tuple[int, ...],
    ) -> None:
        self.spot = spot
        self.action = action
        self.running = running
        self.ends = ends
        self._seconds = deadline.left
        self._deadline = deadline
        self._targets = targets
        self._end: MotionEnd | StagewireError | None = None

    @property
    def done(self) -> bool:
        """Whether nothing more is awaited."""
        exchange = self.running.exchange
        return self._end is not None or (exchange is not None and exchange.done)

    async def wait(self, timeout: float | None) -> MotionEnd:
        """Wait for its end; see :meth:`stagewire.devices.Motion.wait`."""
        if self._end is None:
            seconds = None if timeout is None else self.spot.seconds(timeout)
            deadline = self._deadline if seconds is None else Deadline(self.spot.line, seconds)
            end = await self._wait(seconds, deadline)
            try:
                if self._targets:
                    end = await checked(self.spot, self.running.what, self._targets, end, deadline)
                self._end = end
            except TargetNotReachedError as error:
                self._end = error
        if isinstance(self._end, StagewireError):
            raise self._end
        return self._end

    async def _wait(self, seconds: float | None, deadline: Deadline) -> MotionEnd:
        running, exchange = self.running, self.running.exchange
        if exchange is not None:
            try:
                return self._ended(await self.spot.frames.wait(exchange, seconds))
            except MotionStoppedError as error:
                raise self._stopped(error) from None
            except (MotionTimeoutError, ControllerFaultError) as error:
                if error is not exchange.error or not exchange.written:
                    raise  # it is still waited for, or was never sent
                self._end = await explained(self.spot, error, exchange.timeout)
                raise self._end from None
        if self.action.poll is not None:
            try:
                await _polled(self.spot, running, self.action.poll, deadline)
            except MotionTimeoutError as error:
                if not self._deadline.over:
                    raise  # it may be waited for again
                raise await explained(self.spot, error, self._seconds) from None
            return self._ended(None)
        if self.ends is not None:
            raise _muted(running.what)
        return self._ended(None)

    def _ended(self, message: Message | None) -> MotionEnd:
        running = self.running
        ended = self.spot.line.now() if running.ended is None else running.ended
        values = (
            None if message is None else self.spot.connection.values_of(message, self.spot.place)
        )
        return MotionEnd(message, values, ended - running.started)

    def _stopped(self, error: MotionStoppedError) -> MotionStoppedError:
        """Return the same in the words of the caller, and in units."""
        message = error.message
        if not isinstance(message, Message):
            return MotionStoppedError(f"{self.running.what} was stopped before it was sent")
        connection = self.spot.connection
        values = connection.values_of(message, self.spot.place)
        told = "" if values is None else values.told(connection.channel_field(type(message)))
        said = f": {told}" if told else ""
        return MotionStoppedError(f"{self.running.what} was stopped before its end{said}", message)

    async def stop(self, timeout: float | None) -> MotionEnd | None:
        """Stop it; see :meth:`stagewire.devices.Motion.stop`."""
        table = self.action.halted_by
        if table is None or not self.running.stop:
            raise UnsupportedError(f"{self.running.what}: the unit has no message that stops it")
        defaults = defaults_of(table)
        given = {one.keyword: defaults[one.field] for one in table.given if one.field in defaults}
        return await halt(self.spot, table, timeout, given)


async def act(spot: Spot, action: Action, timeout: float | None, given: Keywords) -> MotionEnd:
    """Start a motion and wait for its end."""
    ends = spot.connection.ends_of(action)
    if ends is not None and spot.connection.silenced(spot.address, ends.completed):
        raise _muted(f"{spot.name}: {action.name}")
    started = await start(spot, action, timeout, given)
    return await started.wait(None)


async def start(spot: Spot, action: Action, timeout: float | None, given: Keywords) -> Started:
    """Start a motion; returns when it is with the line.

    :param timeout: seconds that the whole motion may last.
    """
    what = f"{spot.name}: {action.name}"
    seconds = spot.motion_seconds(timeout)
    fields = fields_of(what, action.given, given, spot.scales())
    message = spot.message(action.message, fields)
    deadline = Deadline(spot.line, seconds)
    try:
        targets = await targets_of(spot, what, action, fields, deadline)
    except ReplyTimeoutError as error:
        raise MotionTimeoutError(f"{what} was not sent: {error}") from None
    ends = spot.connection.ends_of(action)
    running = spot.running(action, what) or Running(what, b"", spot.line.now())
    started = Started(spot, action, running, ends, deadline, targets)
    if action.poll is not None:
        async with spot.lock("motion", what, deadline.left):
            await _refuse_second(spot, what, action.poll, deadline)
            await send_starting(spot, action, message, running, spot.part_of(deadline))
    elif ends is None or spot.connection.silenced(spot.address, ends.completed):
        await send_starting(spot, action, message, running, spot.part_of(deadline))
    else:
        await _begin(spot, message, ends, deadline.left, running)
    return started


async def _begin(
    spot: Spot, message: Message, ends: Ends, seconds: float, running: Running
) -> None:
    motions, place, now = spot.connection.motions, spot.place, spot.line.now

    def ended(exchange: Exchange) -> None:
        running.ended = now()
        if not exchange.written or isinstance(exchange.error, MotionStoppedError | None):
            motions.over(place, running)

    await refuse_left(spot, running.what, seconds)
    before = motions.at(place)
    motions.start(place, running)  # before it is sent: it is to be stopped if all ends meanwhile
    try:
        running.exchange = await spot.frames.begin(message, ends, spot.address, seconds, ended)
    except StagewireError:  # nothing was sent
        motions.refused(place, running, before)
        raise


async def _refuse_second(spot: Spot, what: str, poll: Poll, deadline: Deadline) -> None:
    """Raise where something that was started here still moves."""
    running = spot.connection.motions.at(spot.place)
    if running is None:
        return
    if await _is_busy(spot, poll, spot.part_of(deadline)):
        raise MotionUnderWayError(
            f"{what} was not sent: {running.what} is still under way; wait for its end or stop it first"
        )
    spot.connection.motions.over(spot.place, running)


async def _is_busy(spot: Spot, poll: Poll, seconds: float) -> bool:
    reply = await spot.line.ask(poll.read(), (poll.reply,), spot.address, seconds)
    return bool(getattr(reply, poll.field) != poll.value)


async def _polled(spot: Spot, running: Running, poll: Poll, deadline: Deadline) -> None:
    """Ask again and again, gently, until nothing moves."""
    line = spot.line
    while True:
        await line.pause(min(_POLL, deadline.left))
        if running.stopped:
            raise MotionStoppedError(f"{running.what} was stopped")
        try:
            busy = await _is_busy(spot, poll, spot.part_of(deadline))
        except ReplyTimeoutError:  # one reply that is lost says nothing of the motion
            busy = True
        if running.stopped:
            raise MotionStoppedError(f"{running.what} was stopped")
        if not busy:
            running.ended = line.now()
            spot.connection.motions.over(spot.place, running)
            return
        if deadline.over:
            raise MotionTimeoutError(
                f"{running.what}: still busy after {line.now() - running.started:.3g} s; it may still move: "
                "stop it, or wait for its end again"
            )


async def halt(
    spot: Spot, action: Action, timeout: float | None, given: Keywords
) -> MotionEnd | None:
    """Stop what moves, before everything else that waits.

    Returns None when it is with the line, where the controller says nothing more.
    """
    fields = fields_of(f"{spot.name}: {action.name}", action.given, given, spot.scales())
    message = spot.message(action.message, fields)
    connection, line = spot.connection, spot.line
    ends = connection.ends_of(action)
    if ends is not None and connection.silenced(spot.address, ends.completed):
        ends = None
    if isinstance(timeout, int | float) and timeout <= 0:
        timeout = MOMENT  # a stop is sent whatever time is left
    seconds = spot.seconds(timeout) if ends is None else spot.motion_seconds(timeout)
    began = line.now()
    for _ in range(connection.stops - 1):
        await line.halt(message, None, spot.address, seconds)
    reply = await line.halt(message, ends, spot.address, seconds)
    connection.motions.stopped(spot.place)
    if reply is None:
        return None
    return MotionEnd(reply, connection.values_of(reply, spot.place), line.now() - began)


def _muted(what: str) -> UnsupportedError:
    return UnsupportedError(
        f"{what}: its end is not said while the messages at the end of moves are suspended; let them come "
        "again, or start it without waiting and ask is_moving()"
    )

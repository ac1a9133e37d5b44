"""The asyncio side of a session: a core, a link and one timer, without threads or polling.

One timer of the event loop covers everything that is due. It is moved only to an earlier time. A timer that
fires too early finds nothing to do, which costs less than moving it at every request. Cancelling a task
cancels its exchange and nothing else. There are no locks that could stay locked.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TypeVar

from stagewire._links.link import AsyncLink
from stagewire._sessions import termination
from stagewire._sessions.core import Core, log
from stagewire._sessions.driver import Driver
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.recording import Recording
from stagewire._sessions.waiters import Over
from stagewire.errors import StagewireError, TransportLostError

_C = TypeVar("_C", bound=Core)


def async_clock_of(link: AsyncLink) -> Callable[[], float]:
    """Return the clock of a link, in seconds: the running event loop's."""
    return asyncio.get_running_loop().time


class LoopDriver(Driver[_C]):
    """A core on a link, in the running event loop; the base of the sessions of both framings.

    An asynchronous context manager. For tasks of this loop, not for other loops or threads.

    :param core: the core of the protocol; the session owns it from now on.
    :param link: the link, open and not started; the session owns it from now on.
    :param recording: records all bytes, if given.
    """

    def __init__(self, core: _C, link: AsyncLink, *, recording: Recording | None = None) -> None:
        super().__init__(core, link, recording)
        self._link = link
        self._loop = asyncio.get_running_loop()
        self.now: Callable[[], float] = self._loop.time
        """The time of the session, which is the loop's."""
        self._lock = nullcontext()  # of the core; tasks run uninterrupted between awaits
        self._timer: asyncio.TimerHandle | None = None
        self._timer_at = math.inf
        self._asleep: set[Over] = set()  # waits without an exchange, woken at the end
        termination.remember(self)
        link.start(self._take, self._lose)

    # Building blocks of calls

    def _issue(
        self,
        make: Callable[[float], Exchange],
        on_done: Callable[[Exchange], object],
        on_written: Callable[[Exchange], object] | None = None,
    ) -> Exchange:
        """Make the core create an exchange, and write the bytes that may be written now."""
        self._check_loop()
        exchange = make(self.now())
        if exchange.done:
            on_done(exchange)
        else:
            exchange.on_done = on_done
            exchange.on_written = on_written
            self._pump()
        return exchange

    async def _until(self, over: Over, exchange: Exchange) -> None:
        """Wait until an exchange is over; cancel it if the task is cancelled."""
        try:
            await over.future
        except BaseException:
            self._core.cancel(exchange, self.now())
            self._pump()
            raise

    def _check_loop(self) -> None:
        """Raise if this is not the loop and thread of the session."""
        if asyncio.get_running_loop() is not self._loop:
            raise StagewireError(
                f"{self.url} was opened in another event loop and can only be used there; open it in the "
                "loop that uses it, or use the synchronous classes with several threads"
            )

    # The link

    def _pump(self) -> None:
        """Write the bytes that may be written now, and set the timer for what is due later."""
        if data := self._core.output(self.now(), self._link.has_unread):
            self._write(data)
            self._core.wrote(self.now())
        due = self._core.due
        due = self._core.silent_at if due is None else min(due, self._core.silent_at)
        if due < self._timer_at:
            if self._timer is not None:
                self._timer.cancel()
            self._timer = self._loop.call_at(due, self._tick)
            self._timer_at = due

    def _reschedule(self) -> None:
        """Process what the core was just asked to do, and set the timer."""
        self._pump()

    def _tick(self) -> None:
        """Process what is due. The loop passes on received bytes before it calls a timer."""
        self._timer, self._timer_at = None, math.inf
        with self._in_a_callback():
            self._core.receive(b"", self.now())
            self._core.tick(self.now())
            self._pump()

    def _take(self, data: bytes) -> None:
        """Pass received bytes to the core."""
        with self._in_a_callback():
            self._received(data)
            self._core.receive(data, self.now())
            self._pump()

    @contextmanager
    def _in_a_callback(self) -> Iterator[None]:
        """End the session on an error in this library or in a user's condition, so that no wait hangs."""
        try:
            yield
        except Exception as error:
            log.exception("%s: processing received bytes failed", self.url)
            self._lose(
                TransportLostError(f"{self.url}: processing received bytes failed: {error!r}")
            )

    def _write(self, data: bytes) -> None:
        """Write bytes to the link."""
        try:
            self._link.write(data)
        except TransportLostError as error:
            self._lose(error)
        else:
            self._sent(data)

    def _lose(self, error: TransportLostError) -> None:
        """Note the loss of the link, and end all exchanges and waits."""
        if self.broken_at is None:
            self.broken_at = self.now()
        if self._end is not None:
            return
        self._end = error = self._judged(error)
        self._core.lose(str(error), self.now(), type(error))
        self._wake_all()
        self._gone(error)

    def _wake_all(self) -> None:
        """Wake all waits, at the end."""
        for over in self._asleep:
            over()

    def _check_usable(self) -> None:
        """Raise if the session has ended, or if this is not its loop and thread."""
        self._check_loop()
        super()._check_usable()

    # The end

    async def close(self) -> None:
        """Write the last words, end all exchanges, and close the link.

        Harmless if called twice. Waiting calls raise :class:`~stagewire.errors.SessionClosedError`. If the
        task is cancelled meanwhile, everything is done except closing the link.
        """
        if self.closed:
            return
        self._check_loop()
        self._end_core(self.now())
        self._wake_all()
        if self._timer is not None:
            self._timer.cancel()
        if self._unsaid:
            self._write(self._unsaid)
            self._unsaid = b""
        termination.forget(self)
        try:
            await self._link.close()
        finally:
            if self._recording is not None:
                self._recording.close()

    def end_at_exit(self) -> None:
        """Write the last words at the end of the process, when no loop runs that could close the link."""
        self.say_last()

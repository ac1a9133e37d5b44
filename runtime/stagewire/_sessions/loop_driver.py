"""The asyncio side of a session: a core, a line, and one timer; no thread, and nothing that polls.

What the core has to do at some time is done by one timer of the event loop, which is set anew only when
something is due before it; a timer that comes too early finds nothing to do, and costs less than to move it
at every request. A task that is cancelled cancels what it asked for, and nothing else: there is no lock that
could stay locked.
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
    """Return what tells the time of a link, in seconds: the running event loop."""
    return asyncio.get_running_loop().time


class LoopDriver(Driver[_C]):
    """A core on a line, in the event loop that is running; the base of the sessions of both framings.

    An asynchronous context manager. For tasks of this loop; no call is for another loop or thread.

    :param core: what knows the protocol; it belongs to the session from now on.
    :param link: the line, open and not started; it belongs to the session from now on.
    :param recording: where all that passes is recorded, if anywhere.
    """

    def __init__(self, core: _C, link: AsyncLink, *, recording: Recording | None = None) -> None:
        super().__init__(core, link, recording)
        self._link = link
        self._loop = asyncio.get_running_loop()
        self.now: Callable[[], float] = self._loop.time
        """The time of the session: that of the loop."""
        self._lock = nullcontext()  # of the core; a task is not interrupted between two awaits
        self._timer: asyncio.TimerHandle | None = None
        self._timer_at = math.inf
        self._asleep: set[Over] = set()  # who waits for nothing of the core, to be woken at the end
        termination.remember(self)
        link.start(self._take, self._lose)

    # What calls are made of

    def _issue(
        self,
        make: Callable[[float], Exchange],
        on_done: Callable[[Exchange], object],
        on_written: Callable[[Exchange], object] | None = None,
    ) -> Exchange:
        """Have the core make an exchange, and write what is to be written now."""
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
        """Wait until it is over; cancel the exchange if the task is cancelled."""
        try:
            await over.future
        except BaseException:
            self._core.cancel(exchange, self.now())
            self._pump()
            raise

    def _check_loop(self) -> None:
        """Raise in another loop or thread than that of the session."""
        if asyncio.get_running_loop() is not self._loop:
            raise StagewireError(
                f"{self.url} was opened in another event loop, and can be used in that one alone; open it "
                "in the loop that uses it, or take the synchronous classes for several threads"
            )

    # The line

    def _pump(self) -> None:
        """Write what is to be written now, and see to it that what is due later is done then."""
        if data := self._core.output(self.now(), self._link.has_unread):
            self._write(data)
        due = self._core.due
        due = self._core.silent_at if due is None else min(due, self._core.silent_at)
        if due < self._timer_at:
            if self._timer is not None:
                self._timer.cancel()
            self._timer = self._loop.call_at(due, self._tick)
            self._timer_at = due

    def _reschedule(self) -> None:
        """See to it that what the core was just told to do is done in time."""
        self._pump()

    def _tick(self) -> None:
        """Let the core see to what is due; the loop has passed on what had come before it calls a timer."""
        self._timer, self._timer_at = None, math.inf
        with self._in_a_callback():
            self._core.receive(b"", self.now())
            self._core.tick(self.now())
            self._pump()

    def _take(self, data: bytes) -> None:
        """Give bytes of the line to the core."""
        with self._in_a_callback():
            self._received(data)
            self._core.receive(data, self.now())
            self._pump()

    @contextmanager
    def _in_a_callback(self) -> Iterator[None]:
        """Let nobody wait for ever where a fault of this library, or of a condition of a user, shows."""
        try:
            yield
        except Exception as error:
            log.exception("%s: what takes bytes has failed", self.url)
            self._lose(TransportLostError(f"{self.url}: what takes bytes has failed: {error!r}"))

    def _write(self, data: bytes) -> None:
        """Write bytes to the line."""
        try:
            self._link.write(data)
        except TransportLostError as error:
            self._lose(error)
        else:
            self._sent(data)

    def _lose(self, error: TransportLostError) -> None:
        """Let everybody know that the line is gone, now and for ever."""
        if self.broken_at is None:
            self.broken_at = self.now()
        if self._end is not None:
            return
        self._end = error = self._judged(error)
        self._core.lose(str(error), self.now(), type(error))
        self._wake_all()
        self._gone(error)

    def _wake_all(self) -> None:
        """Wake whoever waits, at the end."""
        for over in self._asleep:
            over()

    def _check_usable(self) -> None:
        """Raise when nothing can be done any more, and in another loop or thread than that of the session."""
        self._check_loop()
        super()._check_usable()

    # The end

    async def close(self) -> None:
        """Say what is to be said last, end everything that waits, and close the line.

        Harmless when done twice. Whoever waits gets a :class:`~stagewire.errors.SessionClosedError`. If the
        task is cancelled meanwhile, everything but the closing of the line is done.
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
        """Say the last words at the end of the process, when no loop runs that could close."""
        self.say_last()

"""The side of a session for threads: a core, a line, and the time.

Every call of a session may be made by any thread. What the core does is done under one lock, for
microseconds; what is written is written under another, in the order in which the core hands it out. A stop
waits for nothing else. Nobody polls: who waits for a reply sleeps on a lock of its own, and is woken by who
reads it.

With ``background=True`` one daemon thread reads, and keeps the controller alive. With ``background=False``
there is none: a thread that waits reads, and of several that wait, one for all. Then no event is received
and no keep-alive message is sent while no thread waits.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Final, TypeVar

from stagewire._links.link import Link
from stagewire._sessions import termination
from stagewire._sessions.core import Core, log
from stagewire._sessions.driver import Driver
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.interrupts import reads_link
from stagewire._sessions.recording import Recording
from stagewire._sessions.waiters import Turns, Waiter
from stagewire.errors import TransportLostError

_C = TypeVar("_C", bound=Core)

_LONGEST_READ: Final = 3600.0
"""Seconds; where nothing is due, a read waits that long and then again."""

_SLICE: Final = 4096
"""Bytes that the core takes at once: a stop gets in between, however much has come."""

_READS_BEFORE: Final = 16
"""So often is read, before a request, of what piled up while nobody read; before a stop, once."""

_ENDING: Final = 1.0
"""Seconds that a thread that reads has to notice that it is over."""


def clock_of(link: Link) -> Callable[[], float]:
    """Return what tells the time of a line, in seconds since whenever: its own clock, or the machine's."""
    return link.clock or time.monotonic


class ThreadDriver(Driver[_C]):
    """A core on a line; the base of the sessions of both framings. A context manager.

    :param core: what knows the protocol; it belongs to the session from now on.
    :param link: the line, open; it belongs to the session from now on.
    :param background: whether a thread reads; never on a line with a clock of its own.
    :param recording: where all that passes is recorded, if anywhere.
    """

    def __init__(
        self,
        core: _C,
        link: Link,
        *,
        background: bool = True,
        recording: Recording | None = None,
    ) -> None:
        super().__init__(core, link, recording)
        self._link = link
        self.now: Callable[[], float] = clock_of(link)
        """The time of the session, in seconds since whenever."""
        self._lock = threading.Lock()  # of the core
        self._writing = threading.Lock()  # taken before that of the core, if both are
        self._due = math.inf  # when the core has something to do next
        self._silent_at = math.inf  # when who reads has to say that nothing came
        self._waits_for_reader = False  # likewise, to have something written
        self._reads_until = -math.inf  # when who reads will look around
        self._turns = Turns()
        self._asleep: set[Waiter] = set()  # who waits for nothing of the core; woken at the end
        self._thread: threading.Thread | None = None
        termination.remember(self)
        if background and link.clock is None:
            self._turns.take_for_good()
            self._thread = threading.Thread(
                target=self._live, name=f"stagewire {link.url}", daemon=True
            )
            self._thread.start()

    # What calls are made of

    def _issue(
        self,
        make: Callable[[float], Exchange],
        waiter: Waiter,
        on_done: Callable[[Exchange], object],
        on_written: Callable[[Exchange], object] | None = None,
        is_stop: bool = False,
    ) -> Exchange:
        """Have the core make an exchange, and write what is to be written now."""
        self._hear_what_came(waiter, 1 if is_stop else _READS_BEFORE)
        with self._lock:
            waiter.exchange = exchange = make(self.now())
            if exchange.done:
                on_done(exchange)
                return exchange
            exchange.on_done = on_done
            exchange.on_written = on_written
            self._look_ahead()
        self._flush(exchange.deadline)
        return exchange

    def _cancel(self, waiter: Waiter) -> None:
        """Give up what an interrupted thread has waited for."""
        if waiter.exchange is not None:
            with self._lock:
                self._core.cancel(waiter.exchange, self.now())
            self._flush(waiter.exchange.deadline)

    # Waiting

    def _wait(self, waiter: Waiter, until: float = math.inf) -> None:
        """Wait until it is over for ``waiter``, or until the time; read meanwhile if nobody does."""
        while not waiter.done and (now := self.now()) < until:
            if self._turns.mine(waiter):
                self._read(until)
            elif not waiter.sleep(min(self._due, until) - now):
                self._tick(until if waiter.exchange is None else waiter.exchange.deadline)

    def _leave(self, waiter: Waiter) -> None:
        """Wait no more: another one reads, and knows when something is due."""
        self._turns.leave(waiter)
        self._wake_reader()

    def _look_ahead(self) -> None:
        """Note when the core has something to do next; under its lock."""
        due = self._core.due
        self._due = math.inf if due is None else due
        self._silent_at = self._core.silent_at
        self._waits_for_reader = self._core.waits_for_reader

    def _reschedule(self) -> None:
        """See to it that what the core was just told to do is done in time."""
        with self._lock:
            self._look_ahead()
        self._wake_reader()

    def _wake_reader(self) -> None:
        """Let who reads look around if it has reason to; who else waits keeps its own time."""
        if min(self._due, self._silent_at) < self._reads_until or self._turns.is_over:
            self._link.wake()

    def _tick(self, until: float = math.inf) -> None:
        """Do what is due, in a thread that does not read; who reads looks around afterwards."""
        self._do_what_is_due(until)
        self._wake_reader()

    def _do_what_is_due(self, until: float = math.inf) -> None:
        """Let the core see to what is due, and write what is to be written, if that can be until then."""
        with self._lock:
            now = self.now()
            if self._due <= now:
                self._core.tick(now)
        self._flush(until)

    # The line

    @reads_link
    def _read(self, until: float = math.inf) -> None:
        """Read once, until something comes or is due, and let the core take it."""
        with self._lock:
            now = self.now()
            self._look_ahead()
            self._reads_until = until = min(self._due, self._silent_at, until)
        try:
            data = self._link.read(min(max(until - now, 0), _LONGEST_READ))
        except TransportLostError as error:
            self._lose(error)
            return
        finally:
            self._reads_until = -math.inf
        self._take(data)
        if self._due <= self.now():
            self._do_what_is_due()

    def _hear_what_came(self, waiter: Waiter, reads: int = 1) -> None:
        """Take what came while nobody read, so that nothing of it answers what is asked now."""
        if self._thread is not None or self._end is not None or not self._turns.mine(waiter):
            return
        try:
            for _ in range(reads):
                data = self._link.read(0)
                self._take(data)
                if not data:
                    break
        except TransportLostError as error:
            self._lose(error)

    def _take(self, data: bytes) -> None:
        """Give bytes of the line to the core; or tell it that nothing came, where that means something."""
        if data:
            self._received(data)
        elif self.now() < self._silent_at and not self._waits_for_reader:
            return
        for start in range(0, len(data) or 1, _SLICE):
            with self._lock:
                self._core.receive(data[start : start + _SLICE], self.now())
                if start + _SLICE >= len(data):
                    self._link.note_dealt_with()
                self._look_ahead()

    def _flush(self, until: float = math.inf) -> None:
        """Write what is to be written now, if no other thread writes all the time until then."""
        if not self._may_write(until):
            return
        try:
            with self._lock:
                data = self._core.output(self.now(), self._is_behind)
                self._look_ahead()
            if data:
                self._write(data)
            if self._waits_for_reader:
                self._link.wake()
        finally:
            self._writing.release()

    def _is_behind(self) -> bool:
        """Say whether the thread that reads has not taken everything that came.

        It may be held up for long where others keep the processor busy.
        """
        thread = self._thread
        return (
            thread is not None and thread.ident != threading.get_ident() and self._link.has_unread()
        )

    def _may_write(self, until: float) -> bool:
        """Wait until no other thread writes: on a line that takes nothing that may last."""
        return self._writing.acquire(timeout=min(max(until - self.now(), 0), threading.TIMEOUT_MAX))

    def _write(self, data: bytes) -> None:
        """Write bytes to the line; under the lock for it."""
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
        with self._lock:
            if self._end is not None:
                return
            self._end = error = self._judged(error)
            self._core.lose(str(error), self.now(), type(error))
            self._wake_all()
        self._gone(error)
        self._link.wake()

    def _wake_all(self) -> None:
        """Wake whoever waits, at the end; under the lock of the core."""
        self._look_ahead()
        for waiter in self._asleep:
            waiter.end()

    def _live(self) -> None:
        """Read for ever; what the thread does."""
        try:
            while self._end is None:
                self._read()
        except BaseException as error:  # a fault of this library, or of a condition of the user's
            log.exception("%s: the thread that reads has failed", self.url)
            self._lose(
                TransportLostError(f"{self.url}: the thread that reads has failed: {error!r}")
            )

    # The end

    def close(self) -> None:
        """Say what is to be said last, end everything that waits, and close the line.

        Harmless when done twice. Whoever waits gets a :class:`~stagewire.errors.SessionClosedError`.
        """
        if self._is_elsewhere:
            return
        with self._writing:
            with self._lock:
                if not self.closed:
                    self._end_core(self.now())
                    self._wake_all()
            if self._unsaid:
                self._write(self._unsaid)
                self._unsaid = b""
        # Also when it is closed already: the closing before may have been interrupted.
        self._link.wake()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(_ENDING)
        self._link.close()
        if self._recording is not None:
            self._recording.close()
        termination.forget(self)

    def end_at_exit(self) -> None:
        """Close at the end of the process."""
        self.close()

    def leave_to_parent(self) -> None:
        """Do nothing any more: this is a fork, whose parent has the line, and the thread that reads."""
        self._lock, self._writing, self._turns = threading.Lock(), threading.Lock(), Turns()
        super().leave_to_parent()
        self._look_ahead()

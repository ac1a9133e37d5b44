"""The thread side of a session: a core, a link and the time.

Any thread may call any method of a session. The core runs under one lock, for microseconds. Bytes are written
under another lock, in the order in which the core hands them out. A stop waits for nothing else. Nothing
polls: a call that waits for a reply sleeps on its own lock, and the thread that reads wakes it.

With ``background=True``, one daemon thread reads and sends keep-alive messages. With ``background=False``
there is none: one of the waiting threads reads for all. While no thread waits, no event is received and no
keep-alive message is sent.
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
"""Seconds; if nothing is due, a read waits this long and is then repeated."""

_SLICE: Final = 4096
"""Bytes that the core takes at a time; a stop can be sent in between, however much has arrived."""

_READS_BEFORE: Final = 16
"""Reads, before a request, of bytes that piled up while no thread read; one read before a stop."""

_ENDING: Final = 1.0
"""Seconds that the reading thread has to notice the end of the session."""


def clock_of(link: Link) -> Callable[[], float]:
    """Return the clock of a link, in seconds since an arbitrary moment: its own, or the machine's."""
    return link.clock or time.monotonic


class ThreadDriver(Driver[_C]):
    """A core on a link; the base of the sessions of both framings. A context manager.

    :param core: the core of the protocol; the session owns it from now on.
    :param link: the link, open; the session owns it from now on.
    :param background: whether a background thread reads; never for a link with its own clock.
    :param recording: records all bytes, if given.
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
        """The time of the session, in seconds since an arbitrary moment."""
        self._lock = threading.Lock()  # of the core
        self._writing = threading.Lock()  # acquired before _lock if both are needed
        self._due = math.inf  # when the core has something to do next
        self._silent_at = math.inf  # when the reader has to report silence
        self._waits_for_reader = False  # whether a write waits for the reader
        self._reads_until = -math.inf  # when the reader will check again
        self._turns = Turns()
        self._asleep: set[Waiter] = set()  # waits without an exchange, woken at the end
        self._thread: threading.Thread | None = None
        termination.remember(self)
        if background and link.clock is None:
            self._turns.take_for_good()
            self._thread = threading.Thread(
                target=self._live, name=f"stagewire {link.url}", daemon=True
            )
            self._thread.start()

    # Building blocks of calls

    def _issue(
        self,
        make: Callable[[float], Exchange],
        waiter: Waiter,
        on_done: Callable[[Exchange], object],
        on_written: Callable[[Exchange], object] | None = None,
        is_stop: bool = False,
    ) -> Exchange:
        """Make the core create an exchange, and write the bytes that may be written now."""
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
        """Cancel the exchange of an interrupted thread."""
        if waiter.exchange is not None:
            with self._lock:
                self._core.cancel(waiter.exchange, self.now())
            self._flush(waiter.exchange.deadline)

    # Waiting

    def _wait(self, waiter: Waiter, until: float = math.inf) -> None:
        """Wait for the end of ``waiter``, or until ``until``; read meanwhile if no other thread does."""
        while not waiter.done and (now := self.now()) < until:
            if self._turns.mine(waiter):
                self._read(until)
            elif not waiter.sleep(min(self._due, until) - now):
                self._tick(until if waiter.exchange is None else waiter.exchange.deadline)

    def _leave(self, waiter: Waiter) -> None:
        """Stop waiting; another thread may read, and learns when something is due."""
        self._turns.leave(waiter)
        self._wake_reader()

    def _look_ahead(self) -> None:
        """Note when the core has something to do next. Requires its lock."""
        due = self._core.due
        self._due = math.inf if due is None else due
        self._silent_at = self._core.silent_at
        self._waits_for_reader = self._core.waits_for_reader

    def _reschedule(self) -> None:
        """Process in time what the core was just asked to do."""
        with self._lock:
            self._look_ahead()
        self._wake_reader()

    def _wake_reader(self) -> None:
        """Wake the reader if it has a reason to check; other waiting threads keep their own time."""
        if min(self._due, self._silent_at) < self._reads_until or self._turns.is_over:
            self._link.wake()

    def _tick(self, until: float = math.inf) -> None:
        """Process what is due, in a thread that does not read; the reader then checks again."""
        self._do_what_is_due(until)
        self._wake_reader()

    def _do_what_is_due(self, until: float = math.inf) -> None:
        """Make the core process what is due, and write its bytes if this is possible until ``until``."""
        with self._lock:
            now = self.now()
            if self._due <= now:
                self._core.tick(now)
        self._flush(until)

    # The line

    @reads_link
    def _read(self, until: float = math.inf) -> None:
        """Read once, until bytes arrive or something is due, and pass the bytes to the core."""
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
        """Process bytes that arrived while no thread read, so that they cannot answer the next request."""
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
        """Pass received bytes to the core, or a silence if it is significant."""
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
        """Write the bytes that may be written now, unless another thread keeps writing until ``until``."""
        if not self._may_write(until):
            return
        try:
            with self._lock:
                data = self._core.output(self.now(), self._is_behind)
                self._look_ahead()
            if data:
                self._write(data)
                with self._lock:
                    self._core.wrote(self.now())
            if self._waits_for_reader:
                self._link.wake()
        finally:
            self._writing.release()

    def _is_behind(self) -> bool:
        """Return whether the reading thread has not taken all bytes that arrived.

        It may be delayed for long if other threads keep the processor busy.
        """
        thread = self._thread
        return (
            thread is not None and thread.ident != threading.get_ident() and self._link.has_unread()
        )

    def _may_write(self, until: float) -> bool:
        """Wait until no other thread writes, which may take long on a link that accepts nothing."""
        return self._writing.acquire(timeout=min(max(until - self.now(), 0), threading.TIMEOUT_MAX))

    def _write(self, data: bytes) -> None:
        """Write bytes to the link. Requires the lock for writing."""
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
        with self._lock:
            if self._end is not None:
                return
            self._end = error = self._judged(error)
            self._core.lose(str(error), self.now(), type(error))
            self._wake_all()
        self._gone(error)
        self._link.wake()

    def _wake_all(self) -> None:
        """Wake all waits, at the end. Requires the lock of the core."""
        self._look_ahead()
        for waiter in self._asleep:
            waiter.end()

    def _live(self) -> None:
        """Read until the session ends; the background thread."""
        try:
            while self._end is None:
                self._read()
        except BaseException as error:  # an error in this library or in a user's condition
            log.exception("%s: the reading thread failed", self.url)
            self._lose(TransportLostError(f"{self.url}: the reading thread failed: {error!r}"))

    # The end

    def close(self) -> None:
        """Write the last words, end all exchanges, and close the link.

        Harmless if called twice. Waiting calls raise :class:`~stagewire.errors.SessionClosedError`.
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
        # Also if it is already closed: the previous close may have been interrupted.
        self._link.wake()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(_ENDING)
        self._link.close()
        if self._recording is not None:
            self._recording.close()
        termination.forget(self)

    def end_at_exit(self) -> None:
        """Close the session at the end of the process."""
        self.close()

    def leave_to_parent(self) -> None:
        """Disable the session in a fork; the parent process owns the link and the reading thread."""
        self._lock, self._writing, self._turns = threading.Lock(), threading.Lock(), Turns()
        super().leave_to_parent()
        self._look_ahead()

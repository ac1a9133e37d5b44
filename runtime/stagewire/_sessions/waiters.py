"""How threads and tasks wait without polling: a lock or a future for each, and one thread that reads."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stagewire._sessions.exchange import Exchange


class Waiter:
    """One thread that waits for something to end; a lock, which is the cheapest thing to wake it by."""

    __slots__ = ("_lock", "done", "exchange")

    def __init__(self) -> None:
        self.exchange: Exchange | None = None
        """What it waits for, if that is an exchange; to be cancelled if the thread is interrupted."""
        self.done = False
        """Whether what it waits for has come."""
        self._lock = threading.Lock()
        self._lock.acquire()

    def end(self, what: object = None) -> None:
        """Say that it has come."""
        self.done = True
        self.nudge()

    def nudge(self) -> None:
        """Wake it to look around."""
        with contextlib.suppress(RuntimeError):  # another thread has woken it already
            self._lock.release()

    def sleep(self, seconds: float) -> bool:
        """Wait until it is woken, at most so long; return whether it was."""
        return self._lock.acquire(timeout=min(max(seconds, 0), threading.TIMEOUT_MAX))


class Turns:
    """Who reads the line: the first who waits, and when it leaves, one of the others.

    A thread that does nothing else may have the turn for good.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._reader: Waiter | None = None
        self._others: dict[Waiter, None] = {}  # in the order in which they came
        self._for_good = False

    def take_for_good(self) -> None:
        """Let one thread read, and nobody else ever."""
        self._for_good = True

    @property
    def is_over(self) -> bool:
        """Whether what the one who reads waits for has come, and it may not know."""
        reader = self._reader
        return reader is not None and reader.done

    def mine(self, waiter: Waiter) -> bool:
        """Say whether it is for this one to read; if not, it is woken when it is."""
        if self._for_good or self._reader is waiter:
            return not self._for_good
        with self._lock:
            if self._reader is None:
                self._reader = waiter
                self._others.pop(waiter, None)
                return True
            self._others[waiter] = None
            return False

    def leave(self, waiter: Waiter) -> None:
        """Wait no more, and let another one read if it was this one's turn."""
        if self._for_good:
            return
        with self._lock:
            self._others.pop(waiter, None)
            if self._reader is waiter:
                self._reader = next(iter(self._others), None)
                if self._reader is not None:
                    self._others.pop(self._reader)
                    self._reader.nudge()


class Over:
    """Wakes the task that waits for something to be over."""

    __slots__ = ("future",)

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.future: asyncio.Future[None] = loop.create_future()

    def __call__(self, what: object = None) -> None:
        """Wake it; harmless when done twice."""
        if not self.future.done():  # or cancelled
            self.future.set_result(None)


class Watchers(list[Callable[["Exchange"], object]]):
    """Who is told when one exchange ends, or is written; itself what the exchange calls."""

    def __call__(self, exchange: Exchange) -> None:
        """Tell all of them."""
        for watcher in tuple(self):
            watcher(exchange)

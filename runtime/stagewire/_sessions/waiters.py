"""Waiting without polling: a lock per thread or a future per task, and one thread that reads."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stagewire._sessions.exchange import Exchange


class Waiter:
    """One waiting thread, with a lock, which is the cheapest way to wake it."""

    __slots__ = ("_lock", "done", "exchange")

    def __init__(self) -> None:
        self.exchange: Exchange | None = None
        """The exchange that it waits for, if any; cancelled if the thread is interrupted."""
        self.done = False
        """Whether the wait is over."""
        self._lock = threading.Lock()
        self._lock.acquire()

    def end(self, what: object = None) -> None:
        """End the wait."""
        self.done = True
        self.nudge()

    def nudge(self) -> None:
        """Wake the thread to check again."""
        with contextlib.suppress(RuntimeError):  # already woken by another thread
            self._lock.release()

    def sleep(self, seconds: float) -> bool:
        """Wait until woken, at most this long; return whether it was woken."""
        return self._lock.acquire(timeout=min(max(seconds, 0), threading.TIMEOUT_MAX))


class Turns:
    """The right to read the link: the first waiting thread has it, and when it leaves, one of the others.

    A background thread may have it for good.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._reader: Waiter | None = None
        self._others: dict[Waiter, None] = {}  # in order of arrival
        self._for_good = False

    def take_for_good(self) -> None:
        """Reserve the right to read for one thread, for good."""
        self._for_good = True

    @property
    def is_over(self) -> bool:
        """Whether the wait of the reader is over and it may not know."""
        reader = self._reader
        return reader is not None and reader.done

    def mine(self, waiter: Waiter) -> bool:
        """Return whether this waiter has to read; if not, it is woken when it has to."""
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
        """Stop waiting; pass the right to read to another waiter."""
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
    """A callback that wakes the task that waits for it."""

    __slots__ = ("future",)

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.future: asyncio.Future[None] = loop.create_future()

    def __call__(self, what: object = None) -> None:
        """Wake the task. Harmless if called twice."""
        if not self.future.done():  # or cancelled
            self.future.set_result(None)


class Watchers(list[Callable[["Exchange"], object]]):
    """Callbacks for the end or the writing of one exchange; itself such a callback."""

    def __call__(self, exchange: Exchange) -> None:
        """Call all of them."""
        for watcher in tuple(self):
            watcher(exchange)

"""Subscriptions as users hold them: the queues of the core, for a thread or for a task."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

from stagewire._codec.events import Event
from stagewire._links.link import Closing
from stagewire._sessions.dispatch import Subscription
from stagewire._sessions.interrupts import defers_interrupts
from stagewire._sessions.waiters import Over, Waiter
from stagewire.errors import ReplyTimeoutError, SessionClosedError

if TYPE_CHECKING:
    from stagewire._sessions.loop_driver import LoopDriver
    from stagewire._sessions.thread_driver import ThreadDriver


_T = TypeVar("_T")


def as_it_came(event: Event) -> Event:
    """Give out an event itself."""
    return event


@defers_interrupts
class _Ended(Generic[_T]):
    """What both have in common: the queue, what is read from its events, and its end."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        defers_interrupts(cls)

    def __init__(self, queue: Subscription, read: Callable[[Event], _T]) -> None:
        self._queue = queue
        self._read = read
        self._closed = False

    def __len__(self) -> int:
        return len(self._queue)

    @property
    def limit(self) -> int:
        """How many events are kept at most."""
        return self._queue.limit

    @property
    def dropped(self) -> int:
        """How many events were lost because nobody took them in time."""
        return self._queue.dropped

    def take(self) -> _T | None:
        """Return the next one if it has come; never waits, and hears nothing."""
        event = self._queue.take()
        return None if event is None else self._read(event)

    def _check(self) -> None:
        """Raise when nothing more will come."""
        if self._queue.error is not None:
            raise self._queue.error
        if self._closed:
            raise SessionClosedError("the subscription was closed; nothing more comes")


def _nothing(timeout: float | None) -> ReplyTimeoutError:
    return ReplyTimeoutError(f"nothing of what is subscribed to came within {timeout} s")


class BlockingSubscription(_Ended[_T], Closing):
    """Events that were wanted, to be taken by threads; an iterator, and a context manager.

    The iteration ends when the subscription or the session is closed, and raises
    :class:`~stagewire.errors.TransportLostError` when the line is lost. What came before is given out first.
    """

    def __init__(
        self, queue: Subscription, driver: ThreadDriver[Any], read: Callable[[Event], _T]
    ) -> None:
        super().__init__(queue, read)
        self._driver = driver
        self._waiters: set[Waiter] = set()
        queue.on_event = self._wake

    def get(self, timeout: float | None = None) -> _T:
        """Return the next one, and wait for it if need be.

        :param timeout: seconds; 0 never waits; None: for ever.

        Raises :class:`~stagewire.errors.ReplyTimeoutError` when none came in time,
        :class:`~stagewire.errors.TransportLostError` and :class:`~stagewire.errors.SessionClosedError`.
        """
        driver = self._driver
        until = math.inf if timeout is None else driver.now() + timeout
        waiter = Waiter()
        with driver._lock:
            self._waiters.add(waiter)
        try:
            driver._hear_what_came(waiter)
            while True:
                waiter.done = False
                if (event := self._queue.take()) is not None:
                    return self._read(event)
                driver._check_usable()
                self._check()
                if not driver.now() < until:  # which is no number, perhaps
                    raise _nothing(timeout)
                driver._wait(waiter, until)
        finally:
            with driver._lock:
                self._waiters.remove(waiter)
            driver._leave(waiter)

    def close(self) -> None:
        """Want nothing more, and end who waits; harmless when done twice."""
        with self._driver._lock:
            self._closed = True
            self._queue.close()
            self._wake()
        self._driver._wake_reader()

    def _wake(self) -> None:
        for waiter in self._waiters:
            waiter.end()

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> _T:
        try:
            return self.get()
        except SessionClosedError:
            raise StopIteration from None


class AsyncSubscription(_Ended[_T]):
    """Events that were wanted, to be taken by tasks; an asynchronous iterator, and a context manager.

    The iteration ends when the subscription or the session is closed, and raises
    :class:`~stagewire.errors.TransportLostError` when the line is lost. What came before is given out first.
    """

    def __init__(
        self, queue: Subscription, driver: LoopDriver[Any], read: Callable[[Event], _T]
    ) -> None:
        super().__init__(queue, read)
        self._driver = driver
        self._waiters: set[Over] = set()
        queue.on_event = self._wake

    async def get(self, timeout: float | None = None) -> _T:
        """Return the next one, and wait for it if need be; see :meth:`BlockingSubscription.get`."""
        driver = self._driver
        until = math.inf if timeout is None else driver.now() + timeout
        while (event := self._queue.take()) is None:
            driver._check_usable()
            self._check()
            left = until - driver.now()
            if not left > 0:
                raise _nothing(timeout)
            over = Over(driver._loop)
            self._waiters.add(over)
            try:
                await asyncio.wait({over.future}, timeout=None if left == math.inf else left)
            finally:
                self._waiters.remove(over)
        return self._read(event)

    def close(self) -> None:
        """Want nothing more, and end who waits; harmless when done twice."""
        self._closed = True
        self._queue.close()
        self._wake()

    def _wake(self) -> None:
        for over in self._waiters:
            over()

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> _T:
        try:
            return await self.get()
        except SessionClosedError:
            raise StopAsyncIteration from None

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

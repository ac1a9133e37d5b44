"""The subscriptions that users hold: queues of the core, for threads or for tasks."""

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
    """Return the event unchanged."""
    return event


@defers_interrupts
class _Ended(Generic[_T]):
    """The base of both kinds: the queue, the function that reads its events, and the end."""

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
        """Most events that are kept."""
        return self._queue.limit

    @property
    def dropped(self) -> int:
        """Number of events that were dropped because they were not taken in time."""
        return self._queue.dropped

    def take(self) -> _T | None:
        """Return the next event if one is queued, otherwise None. Never waits and never reads the link."""
        event = self._queue.take()
        return None if event is None else self._read(event)

    def call_on_event(self, function: Callable[[], object]) -> None:
        """Also call a function, which must be fast, when an event is queued or no more events will follow."""
        wake = self._queue.on_event

        def on_event() -> None:
            if wake is not None:
                wake()
            function()

        self._queue.on_event = on_event

    def check(self) -> None:
        """Raise if no more events will follow."""
        if self._queue.error is not None:
            raise self._queue.error
        if self._closed:
            raise SessionClosedError("the subscription was closed")


def _nothing(timeout: float | None) -> ReplyTimeoutError:
    return ReplyTimeoutError(f"no subscribed event arrived within {timeout} s")


class BlockingSubscription(_Ended[_T], Closing):
    """A queue of wanted events for threads; an iterator and a context manager.

    The iteration ends when the subscription or the session is closed, and raises
    :class:`~stagewire.errors.TransportLostError` when the link is lost. Events received before that are
    returned first.
    """

    def __init__(
        self, queue: Subscription, driver: ThreadDriver[Any], read: Callable[[Event], _T]
    ) -> None:
        super().__init__(queue, read)
        self._driver = driver
        self._waiters: set[Waiter] = set()
        queue.on_event = self._wake

    def get(self, timeout: float | None = None) -> _T:
        """Return the next event; wait for it if the queue is empty.

        :param timeout: seconds; 0 never waits; None waits indefinitely.

        Raises :class:`~stagewire.errors.ReplyTimeoutError` if none arrived in time,
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
                self.check()
                if not driver.now() < until:  # also true for NaN
                    raise _nothing(timeout)
                driver._wait(waiter, until)
        finally:
            with driver._lock:
                self._waiters.remove(waiter)
            driver._leave(waiter)

    def close(self) -> None:
        """Cancel the subscription and end all waits for it. Harmless if called twice."""
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
    """A queue of wanted events for tasks; an asynchronous iterator and a context manager.

    The iteration ends when the subscription or the session is closed, and raises
    :class:`~stagewire.errors.TransportLostError` when the link is lost. Events received before that are
    returned first.
    """

    def __init__(
        self, queue: Subscription, driver: LoopDriver[Any], read: Callable[[Event], _T]
    ) -> None:
        super().__init__(queue, read)
        self._driver = driver
        self._waiters: set[Over] = set()
        queue.on_event = self._wake

    async def get(self, timeout: float | None = None) -> _T:
        """Return the next event; wait if the queue is empty. See :meth:`BlockingSubscription.get`."""
        driver = self._driver
        until = math.inf if timeout is None else driver.now() + timeout
        while (event := self._queue.take()) is None:
            driver._check_usable()
            self.check()
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
        """Cancel the subscription and end all waits for it. Harmless if called twice."""
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

"""The base of sessions for asyncio, independent of the protocol."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from stagewire._codec.events import Event
from stagewire._links.link import AsyncClosing
from stagewire._sessions.core import Core
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.loop_driver import LoopDriver
from stagewire._sessions.subscriptions import AsyncSubscription, as_it_came
from stagewire._sessions.waiters import Over, Watchers
from stagewire.errors import MotionTimeoutError

if TYPE_CHECKING:
    from stagewire._sessions.core import Wanted


_C = TypeVar("_C", bound=Core)
_T = TypeVar("_T")


class AsyncSession(LoopDriver[_C], AsyncClosing):
    """Base of the asyncio sessions of both framings: exchanges to wait for. A context manager.

    For tasks of the event loop in which it was created, not for other loops or threads.
    """

    async def perform(self, make: Callable[[float], Exchange], *, is_stop: bool = False) -> Any:
        """Begin an exchange, wait for its end, and return its result or raise its error.

        Cancelling the task cancels the exchange.

        :param make: makes the core create the exchange; called with the time.
        :param is_stop: used by sessions for threads only; here nothing ever delays writing an exchange.
        """
        over = Over(self._loop)
        exchange = self._issue(make, over)
        await self._until(over, exchange)
        return exchange.value()

    async def start(
        self,
        make: Callable[[float], Exchange],
        on_done: Callable[[Exchange], object] | None = None,
        *,
        is_stop: bool = False,
    ) -> Exchange:
        """Begin an exchange, and return it when its bytes were handed to the link.

        Raises its error if it ends earlier.

        :param on_done: called once at its end; must not call a session.
        :param is_stop: see :meth:`perform`.
        """
        over = Over(self._loop)
        watchers = Watchers([over] if on_done is None else [over, on_done])
        exchange = self._issue(make, watchers, over)
        if not exchange.written:
            await self._until(over, exchange)
        watchers.remove(over)
        if exchange.error is not None and not exchange.written:
            raise exchange.error
        return exchange

    async def wait(self, exchange: Exchange, timeout: float | None = None) -> Any:
        """Wait for the end of an exchange that was started, and return its result or raise its error.

        Cancelling the task does not end the exchange.

        :param timeout: seconds; raises :class:`~stagewire.errors.MotionTimeoutError` when they have passed,
            but the exchange continues. None: the timeout of the exchange itself.
        """
        self._check_loop()
        if not exchange.done:
            over = Over(self._loop)
            watchers: Watchers = exchange.on_done  # type: ignore[assignment]  # of start()
            watchers.append(over)
            try:
                await asyncio.wait({over.future}, timeout=timeout)
            finally:
                watchers.remove(over)
        if not exchange.done:
            raise MotionTimeoutError(
                f"{self.url}: no end within {timeout} s; nothing was stopped, so you can wait again"
            )
        return exchange.value()

    async def pause(self, seconds: float) -> None:
        """Wait for some seconds of the session's time.

        Raises :class:`~stagewire.errors.TransportLostError` or
        :class:`~stagewire.errors.SessionClosedError` as soon as the session ends.
        """
        self._check_usable()
        over = Over(self._loop)
        self._asleep.add(over)
        try:
            await asyncio.wait({over.future}, timeout=seconds)
        finally:
            self._asleep.remove(over)
        self._check_usable()

    def subscribe(
        self, wanted: Wanted = None, limit: int = 1000, source: int | None = None
    ) -> AsyncSubscription[Event]:
        """Return a queue of later events, except replies to requests.

        :param wanted: message classes or event classes, one or a tuple, or a condition on events, which must
            be fast and must not call a session; None: all events.
        :param limit: most events that are kept; beyond that the oldest is dropped and counted.
        :param source: only events from this address or from an unknown one; None: from all addresses.
        """
        return self.subscribe_as(as_it_came, wanted, limit, source)

    def subscribe_as(
        self,
        read: Callable[[Event], _T],
        wanted: Wanted = None,
        limit: int = 1000,
        source: int | None = None,
    ) -> AsyncSubscription[_T]:
        """Return a queue like :meth:`subscribe`, of values that are read from the events.

        :param read: called when an event is taken, by the task that takes it.
        """
        self._check_loop()
        queue = self._core.subscribe(wanted, limit, source)
        return AsyncSubscription(queue, self, read)

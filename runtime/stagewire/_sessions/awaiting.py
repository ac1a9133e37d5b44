"""What sessions for asyncio have in common, whatever they speak."""

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
    """Exchanges that are waited for; the base of the sessions of both framings. A context manager.

    For tasks of the event loop in which it was made; no call is for another loop or thread.
    """

    async def perform(self, make: Callable[[float], Exchange], *, is_stop: bool = False) -> Any:
        """Begin an exchange, wait for its end and return its result, or raise its error.

        If the task is cancelled, so is the exchange.

        :param make: has the core make the exchange; is called with the time.
        :param is_stop: of a session for threads; here nothing ever keeps an exchange from being written.
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
        """Begin an exchange and return it when its bytes are with the line.

        Raises its error if it ends before.

        :param on_done: called once when it ends; it must call no session.
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
        """Wait for the end of an exchange that was started; return its result, or raise its error.

        If the task is cancelled, the exchange goes on.

        :param timeout: seconds; when they have passed, raises
            :class:`~stagewire.errors.MotionTimeoutError`, and
            the exchange goes on. None: as long as the exchange itself may last.
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
                f"{self.url}: no end within {timeout} s; it is still waited for, and may be waited for again"
            )
        return exchange.value()

    async def pause(self, seconds: float) -> None:
        """Wait so long, by the time of the session.

        Raises :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError` as soon as that happens.
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
        """Return a queue of what comes from now on, except what answers a request.

        :param wanted: message classes or event classes, one or a tuple, or a condition on events, which
            has to be quick and to call no session; None: everything.
        :param limit: events that are kept at most; then the oldest is lost, and counted.
        :param source: only what comes from this address, or does not say from where.
        """
        return self.subscribe_as(as_it_came, wanted, limit, source)

    def subscribe_as(
        self,
        read: Callable[[Event], _T],
        wanted: Wanted = None,
        limit: int = 1000,
        source: int | None = None,
    ) -> AsyncSubscription[_T]:
        """Return a queue as :meth:`subscribe` does, of what is read from the events.

        :param read: is called when an event is taken, by whoever takes it.
        """
        self._check_loop()
        queue = self._core.subscribe(wanted, limit, source)
        return AsyncSubscription(queue, self, read)

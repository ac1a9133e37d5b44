"""What sessions for threads have in common, whatever they speak."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from stagewire._codec.events import Event
from stagewire._links.link import Closing
from stagewire._sessions.core import Core
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.subscriptions import BlockingSubscription, as_it_came
from stagewire._sessions.thread_driver import ThreadDriver
from stagewire._sessions.waiters import Waiter, Watchers
from stagewire.errors import MotionTimeoutError

if TYPE_CHECKING:
    from stagewire._sessions.core import Wanted


_C = TypeVar("_C", bound=Core)
_T = TypeVar("_T")


class Session(ThreadDriver[_C], Closing):
    """Exchanges that are waited for; the base of the sessions of both framings. A context manager.

    Every call may be made by any thread.
    """

    def perform(self, make: Callable[[float], Exchange], *, is_stop: bool = False) -> Any:
        """Begin an exchange, wait for its end and return its result, or raise its error.

        An exception that comes from elsewhere, such as ``KeyboardInterrupt``, cancels the exchange.

        :param make: has the core make the exchange; is called with the time.
        :param is_stop: whether nothing may keep it from being written.
        """
        waiter = Waiter()
        try:
            exchange = self._issue(make, waiter, waiter.end, is_stop=is_stop)
            self._wait(waiter)
        except BaseException:
            self._cancel(waiter)
            raise
        finally:
            self._leave(waiter)
        return exchange.value()

    def start(
        self,
        make: Callable[[float], Exchange],
        on_done: Callable[[Exchange], object] | None = None,
        *,
        is_stop: bool = False,
    ) -> Exchange:
        """Begin an exchange and return it when its bytes are with the line.

        Raises its error if it ends before.

        :param on_done: called once when it ends, by whoever notices; it must call no session.
        :param is_stop: whether nothing may keep it from being written.
        """
        waiter = Waiter()
        watchers = Watchers([waiter.end] if on_done is None else [waiter.end, on_done])
        try:
            exchange = self._issue(make, waiter, watchers, waiter.end, is_stop)
            self._wait(waiter)
            if self._may_write(exchange.deadline):  # another thread may, with these very bytes
                self._writing.release()
            with self._lock:
                watchers.remove(waiter.end)
        except BaseException:
            self._cancel(waiter)
            raise
        finally:
            self._leave(waiter)
        if exchange.error is not None and not exchange.written:
            raise exchange.error
        return exchange

    def wait(self, exchange: Exchange, timeout: float | None = None) -> Any:
        """Wait for the end of an exchange that was started; return its result, or raise its error.

        :param timeout: seconds; when they have passed, raises
            :class:`~stagewire.errors.MotionTimeoutError`, and
            the exchange goes on. None: as long as the exchange itself may last.
        """
        waiter = Waiter()
        with self._lock:
            if not exchange.done:
                watchers: Watchers = exchange.on_done  # type: ignore[assignment]  # of start()
                watchers.append(waiter.end)
        if not exchange.done:
            try:
                self._wait(waiter, math.inf if timeout is None else self.now() + timeout)
            finally:
                with self._lock:
                    watchers.remove(waiter.end)
                self._leave(waiter)
        if not exchange.done:
            raise MotionTimeoutError(
                f"{self.url}: no end within {timeout} s; it is still waited for, and may be waited for again"
            )
        return exchange.value()

    def pause(self, seconds: float) -> None:
        """Wait so long, by the time of the session; what comes meanwhile is taken.

        Raises :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError` as soon as that happens.
        """
        waiter = Waiter()
        with self._lock:
            self._check_usable()
            self._asleep.add(waiter)
        try:
            self._wait(waiter, self.now() + seconds)
        finally:
            with self._lock:
                self._asleep.remove(waiter)
            self._leave(waiter)
        self._check_usable()

    def subscribe(
        self, wanted: Wanted = None, limit: int = 1000, source: int | None = None
    ) -> BlockingSubscription[Event]:
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
    ) -> BlockingSubscription[_T]:
        """Return a queue as :meth:`subscribe` does, of what is read from the events.

        :param read: is called when an event is taken, by whoever takes it.
        """
        with self._lock:
            queue = self._core.subscribe(wanted, limit, source)
        return BlockingSubscription(queue, self, read)

"""The base of sessions for threads, independent of the protocol."""

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
    """Base of the sessions for threads of both framings: exchanges to wait for. A context manager.

    All methods may be called from any thread.
    """

    def perform(self, make: Callable[[float], Exchange], *, is_stop: bool = False) -> Any:
        """Begin an exchange, wait for its end, and return its result or raise its error.

        Any other exception, such as ``KeyboardInterrupt``, cancels the exchange.

        :param make: makes the core create the exchange; called with the time.
        :param is_stop: whether nothing may delay writing it.
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
        """Begin an exchange, and return it when its bytes were handed to the link.

        Raises its error if it ends earlier.

        :param on_done: called once at its end, by the thread that notices; must not call a session.
        :param is_stop: whether nothing may delay writing it.
        """
        waiter = Waiter()
        watchers = Watchers([waiter.end] if on_done is None else [waiter.end, on_done])
        try:
            exchange = self._issue(make, waiter, watchers, waiter.end, is_stop)
            self._wait(waiter)
            if self._may_write(exchange.deadline):  # another thread may be writing these very bytes
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
        """Wait for the end of an exchange that was started, and return its result or raise its error.

        :param timeout: seconds; raises :class:`~stagewire.errors.MotionTimeoutError` when they have passed,
            but the exchange continues. None: the timeout of the exchange itself.
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
                f"{self.url}: no end within {timeout} s; nothing was stopped, so you can wait again"
            )
        return exchange.value()

    def pause(self, seconds: float) -> None:
        """Wait for some seconds of the session's time, and process received bytes meanwhile.

        Raises :class:`~stagewire.errors.TransportLostError` or
        :class:`~stagewire.errors.SessionClosedError` as soon as the session ends.
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
    ) -> BlockingSubscription[_T]:
        """Return a queue like :meth:`subscribe`, of values that are read from the events.

        :param read: called when an event is taken, by the thread that takes it.
        """
        with self._lock:
            queue = self._core.subscribe(wanted, limit, source)
        return BlockingSubscription(queue, self, read)

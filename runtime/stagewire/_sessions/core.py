"""The base of all session cores: time that is passed in, subscriptions, and the end of a session.

A core is sans-I/O: it takes received bytes and the time, and returns bytes to send and finished exchanges. It
has no clock, no waits and no threads; its driver calls one method at a time. No received bytes make it raise.
An invalid call raises before it changes anything.

Time is a number of seconds since an arbitrary moment, and never decreases.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from math import inf

from stagewire._sessions.dispatch import Dispatcher, Subscription
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import SessionOptions
from stagewire._sessions.statistics import Statistics
from stagewire.errors import SessionClosedError, StagewireError, TransportLostError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from stagewire._sessions.dispatch import Wanted as Wanted


log = logging.getLogger("stagewire")


def all_is_read() -> bool:
    """Return False: all received bytes were read."""
    return False


class Core:
    """Base of the session cores.

    A driver passes received bytes to :meth:`receive`, writes the bytes of :meth:`output` after each call,
    calls :meth:`wrote`, and calls :meth:`tick` and :meth:`output` when something is :attr:`due`. At
    :attr:`silent_at` it reads the line once more and calls :meth:`receive`, even if nothing arrived.
    """

    def __init__(self, options: SessionOptions | None) -> None:
        self.options = options or SessionOptions()
        self.statistics = Statistics()
        self._dispatcher = Dispatcher(self.statistics)
        self._ready = False  # something may be written now
        self.waits_for_reader = False
        """Whether something is written after the next :meth:`receive`, with bytes or without."""
        self._next = inf  # when the next thing is due
        self._failure: Callable[[Exchange], StagewireError] | None = (
            None  # set at the end of the session
        )
        self._over: StagewireError | None = None  # set at the end of the session

    @property
    def due(self) -> float | None:
        """When :meth:`tick` and :meth:`output` have something to do, possibly now; None: never."""
        if self._ready:
            return 0.0
        return None if self._next == inf else self._next

    @property
    def silent_at(self) -> float:
        """When silence becomes significant, for example because the rest of a frame is missing; inf: never.

        Only the reading part of a driver can distinguish silence from bytes that were not read yet. Time
        alone is therefore not enough: :meth:`receive` must be called without bytes.
        """
        raise NotImplementedError

    # Calls of the driver

    def receive(self, data: bytes, now: float) -> None:
        """Process received bytes, in chunks of any size. ``b""`` means: read, but nothing had arrived."""
        raise NotImplementedError

    def output(self, now: float, has_unread: Callable[[], bool] = all_is_read) -> bytes:
        """Return the bytes to write now. The caller writes them immediately.

        :param has_unread: returns whether bytes have arrived that were not passed to :meth:`receive`. If so,
            requests wait until they were, so that earlier bytes cannot answer them.
        """
        raise NotImplementedError

    def wrote(self, now: float) -> None:
        """Note that the bytes of the last :meth:`output` were written: pauses after them begin now.

        Without this call, they begin at the time of :meth:`output`.
        """
        raise NotImplementedError

    def tick(self, now: float) -> None:
        """Process deadlines and quiet periods that have passed."""
        raise NotImplementedError

    def cancel(self, exchange: Exchange, now: float) -> None:
        """Give up an exchange whose caller no longer waits. Harmless if it has ended.

        An exchange that was not written will not be, except a stop. One that was written cannot be taken
        back: its reply is awaited and discarded, and a motion continues.
        """
        raise NotImplementedError

    def lose(
        self, why: str, now: float, kind: type[TransportLostError] = TransportLostError
    ) -> None:
        """Note that the line is lost: end all exchanges with a :class:`~stagewire.errors.TransportLostError`.

        All later exchanges end the same way, immediately.

        :param kind: the class of the errors.
        """
        if self._failure is None:
            self._finish(lambda exchange: kind(why, _what_of(exchange)), kind(why))

    def close(self, now: float) -> None:
        """End all exchanges with a :class:`~stagewire.errors.SessionClosedError`.

        All later exchanges end the same way, immediately, and nothing more is written. Do nothing if the line
        was lost before.
        """
        if self._failure is not None:
            return
        over = SessionClosedError("the session was closed")
        self._finish(lambda exchange: SessionClosedError(f"{over}; {_what_of(exchange)}"), over)

    @property
    def has_understood(self) -> bool:
        """Whether a message has been received."""
        raise NotImplementedError

    # Subscriptions

    def subscribe(
        self, wanted: Wanted = None, limit: int = 1000, source: int | None = None
    ) -> Subscription:
        """Return a queue of later events, except replies to requests.

        :param wanted: message classes or event classes, one or a tuple, or a condition on events, which must
            be fast; None: all events.
        :param limit: most events that are kept; beyond that the oldest is dropped and counted.
        :param source: only events from this address or from an unknown one; None: from all addresses.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a limit below 1 and
        :class:`~stagewire.errors.BadValueError` for an invalid ``wanted``.
        """
        subscription = self._dispatcher.subscribe(wanted, limit, source)
        if self._over is not None:
            self._dispatcher.end(self._over)
        return subscription

    # For the subclasses

    def _was_read(self) -> None:
        """Note that all available bytes were read."""
        if self.waits_for_reader:
            self.waits_for_reader = False
            self._ready = True

    def _at(self, when: float) -> None:
        """Note that something is due at this time."""
        if when < self._next:
            self._next = when

    def _waiting(self) -> Iterator[Exchange]:
        """Yield all exchanges that have not ended."""
        raise NotImplementedError

    def _cancelled(self, exchange: Exchange) -> StagewireError:
        """Count a cancelled exchange, and return its error; other exchanges may be written now."""
        self.statistics.cancelled += 1
        self._ready = True
        sent = "it was sent and may be carried out" if exchange.written else "it was not sent"
        return StagewireError(f"{exchange.name} was cancelled: {sent}")

    def _finish(self, failure: Callable[[Exchange], StagewireError], over: StagewireError) -> None:
        waiting = list(self._waiting())
        self._failure = failure
        self._over = over
        self._ready, self._next = False, inf
        for exchange in waiting:
            exchange.end(error=failure(exchange))
        self._dispatcher.end(over)

    def _refuse(self, exchange: Exchange) -> bool:
        """End a new exchange if the session is over; return whether it is."""
        if self._failure is None:
            return False
        exchange.end(error=self._failure(exchange))
        return True


def _what_of(exchange: Exchange) -> str:
    """Return the state of an exchange at the end of the session."""
    name = exchange.name
    if not exchange.written:
        return f"{name} was not sent"
    if exchange.is_question:
        return f"{name} was sent but not answered"
    return f"{name} was sent but not answered: it may have been carried out, and is not sent again"

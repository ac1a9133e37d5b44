"""What all session cores have in common: time that is passed in, subscriptions, and the end.

A core is a session without input or output: bytes and the time go in, bytes and the ends of exchanges come
out. It reads no clock, waits for nothing, and knows no threads: who drives it calls one method at a time.
Nothing that comes from outside makes it raise; a call that is wrong raises before anything is done.

The time is a number of seconds since whenever, that does not go back.
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

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from stagewire._sessions.dispatch import Wanted as Wanted


log = logging.getLogger("stagewire")


def all_is_read() -> bool:
    """Say that nothing came that was not read."""
    return False


class Core:
    """Base of the session cores.

    What the driver has to do: give it what comes (:meth:`receive`), write what it says (:meth:`output`)
    after each call, and call :meth:`tick` and :meth:`output` when something is :attr:`due`. At
    :attr:`silent_at` it reads the line once more and calls :meth:`receive`, even if nothing came.
    """

    def __init__(self, options: SessionOptions | None) -> None:
        self.options = options or SessionOptions()
        self.statistics = Statistics()
        self._dispatcher = Dispatcher(self.statistics)
        self._ready = False  # something may be written at once
        self.waits_for_reader = False
        """Whether something is written as soon as :meth:`receive` was called, with bytes or without."""
        self._next = inf  # nothing else is due before
        self._failure: Callable[[Exchange], StagewireError] | None = None  # since the end
        self._over: StagewireError | None = None  # likewise

    @property
    def due(self) -> float | None:
        """When :meth:`tick` and :meth:`output` have something to do, which may be now; None: never."""
        if self._ready:
            return 0.0
        return None if self._next == inf else self._next

    @property
    def silent_at(self) -> float:
        """When silence will mean something, such as that the rest of a frame is missing; inf: never.

        Only the part of a driver that reads the line can tell silence from bytes that it has not read yet.
        So time alone is not enough: :meth:`receive` has to be called without bytes.
        """
        raise NotImplementedError

    # The driver's side

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that came, in chunks of any size; none: the line was read, and nothing had come."""
        raise NotImplementedError

    def output(self, now: float, has_unread: Callable[[], bool] = all_is_read) -> bytes:
        """Return everything that is to be written now; the caller writes it at once.

        :param has_unread: says whether something came that :meth:`receive` was not given yet. Then what is
            answered waits until it was called, so that nothing that came before answers it.
        """
        raise NotImplementedError

    def tick(self, now: float) -> None:
        """See to what is due: deadlines, and quiet periods."""
        raise NotImplementedError

    def cancel(self, exchange: Exchange, now: float) -> None:
        """Give up an exchange, because nobody waits for it any more; harmless when it has ended.

        What was not written will not be, except a stop. What was written cannot be taken back: its reply
        is awaited and swallowed, and a motion goes on.
        """
        raise NotImplementedError

    def lose(
        self, why: str, now: float, kind: type[TransportLostError] = TransportLostError
    ) -> None:
        """Note that the line is gone: what waits ends with a :class:`~stagewire.errors.TransportLostError`.

        So does everything from then on, at once.

        :param kind: the class of the errors.
        """
        if self._failure is None:
            self._finish(lambda exchange: kind(why, _what_of(exchange)), kind(why))

    def close(self, now: float) -> None:
        """End everything that waits with a :class:`~stagewire.errors.SessionClosedError`.

        So does everything from then on, at once. Nothing more is written. After the line was lost this
        changes nothing.
        """
        if self._failure is not None:
            return
        over = SessionClosedError("the session was closed")
        self._finish(lambda exchange: SessionClosedError(f"{over}; {_what_of(exchange)}"), over)

    @property
    def has_understood(self) -> bool:
        """Whether a message has come."""
        raise NotImplementedError

    # Subscriptions

    def subscribe(
        self, wanted: Wanted = None, limit: int = 1000, source: int | None = None
    ) -> Subscription:
        """Return a queue of what comes from now on, except what answers a request.

        :param wanted: message classes or event classes, one or a tuple, or a condition on events, which
            has to be quick; None: everything.
        :param limit: events that are kept at most; then the oldest is lost, and counted.
        :param source: only what comes from this address, or does not say from where; None: from anywhere.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a limit below 1 and
        :class:`~stagewire.errors.BadValueError` for what cannot be wanted.
        """
        subscription = self._dispatcher.subscribe(wanted, limit, source)
        if self._over is not None:
            self._dispatcher.end(self._over)
        return subscription

    # For both cores

    def _was_read(self) -> None:
        """Note that what had come was read."""
        if self.waits_for_reader:
            self.waits_for_reader = False
            self._ready = True

    def _at(self, when: float) -> None:
        """Note that something is due then."""
        if when < self._next:
            self._next = when

    def _waiting(self) -> Iterator[Exchange]:
        """Yield every exchange that has not ended."""
        raise NotImplementedError

    def _cancelled(self, exchange: Exchange) -> StagewireError:
        """Count an exchange that is given up, and return its error; others may be written now."""
        self.statistics.cancelled += 1
        self._ready = True
        sent = "it was sent, and may be carried out" if exchange.written else "it was not sent"
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
        """End a new exchange if the session is over, and say whether it is."""
        if self._failure is None:
            return False
        exchange.end(error=self._failure(exchange))
        return True


def _what_of(exchange: Exchange) -> str:
    """Return what is known of an exchange at the end."""
    name = exchange.name
    if not exchange.written:
        return f"{name} was not sent"
    if exchange.is_question:
        return f"{name} was sent and not answered"
    return f"{name} was sent and not answered: it may have been carried out, and is not sent again"

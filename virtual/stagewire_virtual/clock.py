"""Time for virtual controllers: a clock that is passed in, with the timers that hang on it.

A clock knows the time, in whole nanoseconds since it was made, and what is due when. Nothing in this
package asks the machine for the time or sleeps but :class:`RealClock` and who serves it.

While a timer runs, :attr:`Clock.now` is the instant that it was set for, not that at which somebody came
round to running it. A controller that is looked at late therefore has said and done the same things, with
the same times, as one that was looked at at every instant.
"""

from __future__ import annotations

import heapq
import math
import numbers
import time
from collections.abc import Callable
from typing import Final

from stagewire.errors import BadValueError

SECOND: Final = 1_000_000_000
"""Nanoseconds in a second."""

_CANCELLED_AT_LEAST: Final = 64  # fewer are not worth the clearing


def nanoseconds(seconds: float) -> int:
    """Return ``seconds`` as whole nanoseconds, to the nearest."""
    return round(seconds * SECOND)


def passes(seconds: float) -> bool:
    """Say whether a time can pass: a number that is not negative and has an end."""
    return isinstance(seconds, numbers.Real) and 0 <= seconds * SECOND < math.inf


class Timer:
    """Something that is due at an instant; made by :meth:`Clock.call_at`."""

    __slots__ = ("_clock", "callback", "cancelled", "when")

    def __init__(self, clock: Clock, when: int, callback: Callable[[], None]) -> None:
        self._clock = clock
        self.when = when
        self.callback = callback
        self.cancelled = False

    def cancel(self) -> None:
        """See to it that the timer does not run; harmless when it has."""
        if not self.cancelled:
            self.cancelled = True
            self._clock._forget_cancelled()


class Clock:
    """The time and what is due; the base of both clocks."""

    def __init__(self) -> None:
        self._now = 0
        self._count = 0  # timers of one instant run in the order in which they were set
        self._due: list[tuple[int, int, Timer]] = []
        self._cancelled = 0  # since the heap was last cleared of them
        self.on_earlier: Callable[[], None] | None = None
        """Called when a timer becomes the next one that is due; for who sleeps until then."""

    @property
    def now(self) -> int:
        """The time in nanoseconds."""
        return self._now

    def call_at(self, when: int, callback: Callable[[], None]) -> Timer:
        """Run ``callback`` at the instant ``when``, or as soon as time goes on if that has passed."""
        timer = Timer(self, max(when, self._now), callback)
        self._count += 1
        entry = (timer.when, self._count, timer)
        heapq.heappush(self._due, entry)
        if self._due[0] is entry and self.on_earlier is not None:
            self.on_earlier()
        return timer

    def call_later(self, delay: int, callback: Callable[[], None]) -> Timer:
        """Run ``callback`` after ``delay`` nanoseconds."""
        return self.call_at(self.now + delay, callback)

    @property
    def next_due(self) -> int | None:
        """The instant of the next timer, or None when nothing is due."""
        while self._due and self._due[0][2].cancelled:
            heapq.heappop(self._due)
        return self._due[0][0] if self._due else None

    def _forget_cancelled(self) -> None:
        """Clear the heap when most of it may be cancelled: a host may cancel far-away timers for ever."""
        self._cancelled += 1
        if self._cancelled > len(self._due) // 2 + _CANCELLED_AT_LEAST:
            self._due = [entry for entry in self._due if not entry[2].cancelled]
            heapq.heapify(self._due)
            self._cancelled = 0

    def run_until(self, when: int) -> None:
        """Let time go on to the instant ``when``, running what is due on the way, in order."""
        while (due := self.next_due) is not None and due <= when:
            timer = heapq.heappop(self._due)[2]
            self._now = max(self._now, due)
            timer.callback()
        self._now = max(self._now, when)


class SteppedClock(Clock):
    """A clock that stands still until it is told to go on; for tests."""

    call: Callable[..., None] | None = None
    """Calls a function in the thread where the controllers live, if who serves them has one of its own."""

    def advance(self, seconds: float) -> None:
        """Let ``seconds`` pass.

        Raises :class:`~stagewire.errors.BadValueError` for a time that is negative or has no end.
        """
        if not passes(seconds):
            raise BadValueError(f"time goes forward by a number of seconds, not by {seconds!r}")
        if self.call is None:
            self._pass(seconds)
        else:
            self.call(self._pass, seconds)

    def _pass(self, seconds: float) -> None:
        self.run_until(self._now + nanoseconds(seconds))


class RealClock(Clock):
    """The machine's monotonic clock. Timers run when :meth:`run_until` is called.

    :param reading: tells the time in nanoseconds since whenever; another one may go by an event loop.
    """

    def __init__(self, reading: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__()
        self._reading = reading
        self._start = reading()
        self._running = False

    @property
    def now(self) -> int:
        """The time in nanoseconds; while a timer runs, the instant that it was set for."""
        return self._now if self._running else max(self._now, self._reading() - self._start)

    def run_until(self, when: int) -> None:
        """Let time go on to the instant ``when``, running what is due on the way, in order."""
        self._running = True
        try:
            super().run_until(when)
        finally:
            self._running = False

"""Clocks with timers for virtual controllers.

A clock has the time, in whole nanoseconds since it was created, and a list of timers. In this package only
:class:`RealClock` and the servers that run it read the system clock or sleep.

While a timer runs, :attr:`Clock.now` is the instant for which the timer was set, not the instant at which it
actually runs. A controller that is run late therefore does the same things at the same times as one that is
run continuously.
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

_CANCELLED_AT_LEAST: Final = 64  # fewer are not worth clearing


def nanoseconds(seconds: float) -> int:
    """Return ``seconds`` rounded to whole nanoseconds."""
    return round(seconds * SECOND)


def passes(seconds: float) -> bool:
    """Return whether ``seconds`` is a valid duration: a finite number, not negative."""
    return isinstance(seconds, numbers.Real) and 0 <= seconds * SECOND < math.inf


class Timer:
    """A callback that is due at an instant; created by :meth:`Clock.call_at`."""

    __slots__ = ("_clock", "callback", "cancelled", "when")

    def __init__(self, clock: Clock, when: int, callback: Callable[[], None]) -> None:
        self._clock = clock
        self.when = when
        self.callback = callback
        self.cancelled = False

    def cancel(self) -> None:
        """Cancel the timer; safe after it has run."""
        if not self.cancelled:
            self.cancelled = True
            self._clock._forget_cancelled()


class Clock:
    """The time and its timers; the base of both clocks."""

    def __init__(self) -> None:
        self._now = 0
        self._count = 0  # timers with the same instant run in the order in which they were set
        self._due: list[tuple[int, int, Timer]] = []
        self._cancelled = 0  # timers cancelled since the heap was last cleared
        self.on_earlier: Callable[[], None] | None = None
        """Called when a new timer becomes the next one, so that a sleeping server wakes up earlier."""

    @property
    def now(self) -> int:
        """The time in nanoseconds."""
        return self._now

    def call_at(self, when: int, callback: Callable[[], None]) -> Timer:
        """Run ``callback`` at the instant ``when``, or at the next :meth:`run_until` if that has passed."""
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
        """The instant of the next timer; None without timers."""
        while self._due and self._due[0][2].cancelled:
            heapq.heappop(self._due)
        return self._due[0][0] if self._due else None

    def _forget_cancelled(self) -> None:
        """Clear the heap when most timers may be cancelled, so that hosts cannot make it grow without end."""
        self._cancelled += 1
        if self._cancelled > len(self._due) // 2 + _CANCELLED_AT_LEAST:
            self._due = [entry for entry in self._due if not entry[2].cancelled]
            heapq.heapify(self._due)
            self._cancelled = 0

    def run_until(self, when: int) -> None:
        """Advance to the instant ``when`` and run the timers that are due until then, in order."""
        while (due := self.next_due) is not None and due <= when:
            timer = heapq.heappop(self._due)[2]
            self._now = max(self._now, due)
            timer.callback()
        self._now = max(self._now, when)


class SteppedClock(Clock):
    """A clock that only runs when :meth:`advance` is called; for tests."""

    call: Callable[..., None] | None = None
    """Calls a function in the thread that runs the controllers; None if they run in the caller's thread."""

    def advance(self, seconds: float) -> None:
        """Advance the clock by ``seconds``.

        Raises :class:`~stagewire.errors.BadValueError` if that is negative, infinite or not a number.
        """
        if not passes(seconds):
            raise BadValueError(f"seconds must be a finite number of at least 0, not {seconds!r}")
        if self.call is None:
            self._pass(seconds)
        else:
            self.call(self._pass, seconds)

    def _pass(self, seconds: float) -> None:
        self.run_until(self._now + nanoseconds(seconds))


class RealClock(Clock):
    """The machine's monotonic clock. Timers run when :meth:`run_until` is called.

    :param reading: returns the time in nanoseconds from any origin, such as the time of an event loop.
    """

    def __init__(self, reading: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__()
        self._reading = reading
        self._start = reading()
        self._running = False

    @property
    def now(self) -> int:
        """The time in nanoseconds; while a timer runs, the instant for which it was set."""
        return self._now if self._running else max(self._now, self._reading() - self._start)

    def run_until(self, when: int) -> None:
        """Advance to the instant ``when`` and run the timers that are due until then, in order."""
        self._running = True
        try:
            super().run_until(when)
        finally:
            self._running = False

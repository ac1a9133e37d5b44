"""Status updates: from the start to the stop, at the unit's own rate."""

from __future__ import annotations

from collections.abc import Callable

from stagewire import Frame
from stagewire_virtual.clock import Clock, Timer

__all__ = ["Updates"]


class Updates:
    """Says the status of a controller again and again.

    :param clock: the time.
    :param period: between two updates, in nanoseconds; the first comes one period after the start.
    :param say: says the status once, to who sent the frame that it is given.
    """

    def __init__(self, clock: Clock, period: int, say: Callable[[Frame], None]) -> None:
        self._clock = clock
        self._period = period
        self._say = say
        self._timer: Timer | None = None

    def start(self, cause: Frame) -> None:
        """Say the status to who sent ``cause`` from now on; when it is being said already, keep the beat."""
        self._cause = cause
        if self._timer is None:
            self._timer = self._clock.call_later(self._period, self._tick)

    def stop(self) -> None:
        """Say nothing more; harmless when nothing is said."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tick(self) -> None:
        self._timer = self._clock.call_later(self._period, self._tick)
        self._say(self._cause)

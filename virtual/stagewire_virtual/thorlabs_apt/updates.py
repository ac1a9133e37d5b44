"""Status updates: from the start to the stop, at the unit's own rate."""

from __future__ import annotations

from collections.abc import Callable

from stagewire import Frame
from stagewire_virtual.clock import Clock, Timer

__all__ = ["Updates"]


class Updates:
    """Says the status of a controller again and again.

    :param clock: the time.
    :param say: says the status once, to who sent the frame that it is given.
    """

    def __init__(self, clock: Clock, say: Callable[[Frame], None]) -> None:
        self._clock = clock
        self._say = say
        self._timer: Timer | None = None

    def start(self, cause: Frame, period: int) -> None:
        """Say the status to who sent ``cause``, once a period from now on, in nanoseconds.

        When it is being said already, the beat goes on.
        """
        self._cause = cause
        self._period = period
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

"""A quantity that follows its target exponentially, with a formula for every instant."""

from __future__ import annotations

import math

from stagewire_virtual.clock import SECOND, Clock


class Follower:
    """A quantity that approaches its target with a time constant.

    :param clock: the clock.
    :param time_constant: the time constant in seconds.
    :param value: the first value, which is also the first target.
    """

    def __init__(self, clock: Clock, time_constant: float, value: float = 0.0) -> None:
        self._clock = clock
        self._time_constant = time_constant
        self.jump(value)

    @property
    def target(self) -> float:
        """The present target."""
        return self._target

    @property
    def value(self) -> float:
        """The present value."""
        seconds = (self._clock.now - self._since) / SECOND
        rest = math.exp(-seconds / self._time_constant)
        return self._target + (self._start - self._target) * rest

    def follow(self, target: float) -> None:
        """Approach a target from the present value."""
        self._start, self._since, self._target = self.value, self._clock.now, target

    def jump(self, value: float) -> None:
        """Take a value immediately."""
        self._start = self._target = value
        self._since = self._clock.now

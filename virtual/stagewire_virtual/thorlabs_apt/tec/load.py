"""A thermal load and the loop that drives it, with a formula for every instant.

The load has one heat capacity and loses heat to its surroundings. The document has none of these numbers; all
are our choice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from stagewire_virtual.clock import SECOND, Clock

HEAT_CAPACITY: Final = 10.0
"""In J/K."""
CONDUCTANCE: Final = 1 / 6
"""Heat lost to the surroundings in W/K. The load alone has a time constant of 60 s."""
PUMPED: Final = 5.0
"""Heat that the element pumps in W/A. At rest, 1 A is 30 degrees."""


@dataclass(frozen=True, slots=True)
class Loop:
    """A proportional loop, whose current is limited.

    :param target: the set point in degrees Celsius.
    :param hold: the current at the set point, in amperes.
    :param gain: the change of the current in A/K.
    :param limit: the largest current in either direction, in amperes.
    """

    target: float
    hold: float
    gain: float
    limit: float

    def current(self, temperature: float) -> float:
        """Return the current at a temperature; positive heats, negative cools."""
        asked = self.hold + self.gain * (self.target - temperature)
        return min(max(asked, -self.limit), self.limit)

    def after(self, start: float, surroundings: float, seconds: float) -> float:
        """Return the temperature of the load some time after it had the temperature ``start``.

        The temperature rises or falls through up to three regions: full heating, proportional, full cooling.
        """
        edges = (
            self.target - (self.limit - self.hold) / self.gain,
            self.target + (self.limit + self.hold) / self.gain,
        )
        stiffness = CONDUCTANCE + PUMPED * self.gain
        offset = self.hold + self.gain * self.target
        slow = HEAT_CAPACITY / CONDUCTANCE
        regions = (  # where the load would go, and how fast
            (surroundings + self.limit * PUMPED / CONDUCTANCE, slow),
            ((CONDUCTANCE * surroundings + PUMPED * offset) / stiffness, HEAT_CAPACITY / stiffness),
            (surroundings - self.limit * PUMPED / CONDUCTANCE, slow),
        )
        at = sum(start > edge for edge in edges)
        while True:
            goal, time_constant = regions[at]
            step = 1 if goal > start else -1
            border = at if step > 0 else at - 1
            if not 0 <= border < len(edges):
                break
            edge = edges[border]
            if (goal - edge) * step <= 0:
                break
            lasts = time_constant * math.log((goal - start) / (goal - edge))
            if seconds <= lasts:
                break
            start, seconds, at = edge, seconds - lasts, at + step
        return _approach(start, goal, time_constant, seconds)


class Load:
    """A load at a temperature element.

    :param clock: the clock.
    :param surroundings: the temperature of the surroundings, and at first of the load, in degrees Celsius.
    """

    def __init__(self, clock: Clock, surroundings: float) -> None:
        self._clock = clock
        self._surroundings = self._start = surroundings
        self._since = clock.now
        self._loop: Loop | None = None

    @property
    def temperature(self) -> float:
        """The present temperature in degrees Celsius."""
        seconds = (self._clock.now - self._since) / SECOND
        if self._loop is None:
            slow = HEAT_CAPACITY / CONDUCTANCE
            return _approach(self._start, self._surroundings, slow, seconds)
        return self._loop.after(self._start, self._surroundings, seconds)

    @property
    def current(self) -> float:
        """The present current of the element in amperes; positive heats, negative cools."""
        return self._loop.current(self.temperature) if self._loop else 0.0

    @property
    def surroundings(self) -> float:
        """The temperature of the surroundings in degrees Celsius."""
        return self._surroundings

    @surroundings.setter
    def surroundings(self, temperature: float) -> None:
        self.drive(self._loop)
        self._surroundings = temperature

    def drive(self, loop: Loop | None) -> None:
        """Drive the element with another loop from now on; None switches it off."""
        self._start, self._since, self._loop = self.temperature, self._clock.now, loop


def _approach(start: float, goal: float, time_constant: float, seconds: float) -> float:
    return goal + (start - goal) * math.exp(-seconds / time_constant)

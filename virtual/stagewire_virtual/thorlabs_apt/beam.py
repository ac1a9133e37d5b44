"""A beam on a quad detector, and the feedback loop of one axis that centres it."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Final

from stagewire.errors import BadValueError
from stagewire_virtual.clock import SECOND

FULL_VOLTS: Final = 10.0
"""Full scale of all signals and outputs in V (page 332)."""

_NEAREST, _FARTHEST = 0.2, 0.6  # of a seeded beam from the centre


@dataclass(frozen=True, slots=True)
class Beam:
    """A beam, where it hits the detector while both outputs are at 0 V.

    :param left: its distance from the centre to the left, -1 to 1; 1 is the edge of the detector.
    :param top: its distance from the centre to the top.
    :param power: the sum signal in V, 0 to 10; 0 if it is blocked.

    Raises :class:`~stagewire.errors.BadValueError` for a value out of range.
    """

    left: float
    top: float
    power: float = 5.0

    def __post_init__(self) -> None:
        if not (-1 <= self.left <= 1 and -1 <= self.top <= 1):
            raise BadValueError(f"a beam must be from -1 to 1, not at {self.left}, {self.top}")
        if not 0 <= self.power <= FULL_VOLTS:
            raise BadValueError(f"a sum signal must be from 0 to 10 V, not {self.power}")


def seeded_beam(chance: random.Random) -> Beam:
    """Return a beam at a random place off the centre."""
    left, top = (chance.choice((-1, 1)) * chance.uniform(_NEAREST, _FARTHEST) for _ in range(2))
    return Beam(left, top)


@dataclass(frozen=True, slots=True)
class Loop:
    """The feedback loop of one axis, from an instant at which something changed.

    The output is the proportional share of the signal plus the integral; the signal is that of the beam at
    0 V, less the effect of the output. The solution is an exponential with the time constant
    (1 + effect · proportional) / (effect · integral).

    :param began: the instant, in nanoseconds.
    :param offset: the signal in V with an output of 0 V.
    :param effect: the change of the signal in V for 1 V of the output; 0 without a beam.
    :param proportional: the proportional constant, with the sense and gain of the output.
    :param integral: the integral constant in 1/s, with the sense and gain of the output.
    :param stored: the value of the integral at that instant, in V.
    :param low: the lowest output in V.
    :param high: the highest output in V.
    """

    began: int
    offset: float
    effect: float
    proportional: float
    integral: float
    stored: float
    low: float
    high: float

    @property
    def time_constant(self) -> float:
        """The time constant in s; infinite if the loop does not centre the beam by itself."""
        speed = self.effect * self.integral
        return (1 + self.effect * self.proportional) / speed if speed > 0 else math.inf

    def output(self, now: int) -> float:
        """Return the output at an instant, in V."""
        if not self.effect:
            return self._limited(self.stored + self.proportional * self.offset)
        share = 1 + self.effect * self.proportional
        wanted = self.offset - self.effect * self.stored
        if share <= 0:  # the loop runs away at once
            return self._limited(math.copysign(math.inf, self.proportional * wanted))
        power = -self.effect * self.integral / share * (now - self.began) / SECOND
        signal = wanted / share * math.exp(min(power, 100.0))
        return self._limited((self.offset - signal) / self.effect)

    def signal(self, now: int) -> float:
        """Return the signal at an instant, in V."""
        return self.offset - self.effect * self.output(now)

    def integral_at(self, now: int) -> float:
        """Return the value of the integral at an instant, in V; it does not grow beyond the limits."""
        return self.output(now) - self.proportional * self.signal(now)

    def _limited(self, volts: float) -> float:
        return min(max(volts, self.low), self.high)

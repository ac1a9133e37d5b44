"""How an output goes to its target: at most so fast, and gently at the end if a loop is closed."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Approach"]


@dataclass(frozen=True, slots=True)
class Approach:
    """The way of a value to its target, known at every instant from a formula.

    Two things hold it back. A slew limit lets it change by one count in ``crossing`` nanoseconds at most. A
    loop makes its speed what is left of the way, divided by ``settling``. It keeps to the slower of the
    two: a straight ramp, and an exponential from where that is the slower one. With neither it is at its
    target at once.

    :param start: the value at the beginning, in counts.
    :param target: where it goes, in counts.
    :param began: the instant at which it sets out, in nanoseconds.
    :param crossing: nanoseconds for a count; 0 for no slew limit.
    :param settling: time constant in nanoseconds; 0 for no loop, infinite for a loop that does nothing.
    """

    start: float
    target: float
    began: int = 0
    crossing: float = 0.0
    settling: float = 0.0

    @property
    def ramp(self) -> int:
        """How long the straight part lasts, in nanoseconds; without a loop it ends at the target."""
        return math.ceil(max(0.0, abs(self.target - self.start) - self._knee) * self.crossing)

    def at(self, now: int) -> float:
        """Return the value at the instant ``now``."""
        elapsed = now - self.began
        way = self.target - self.start
        straight = max(0.0, abs(way) - self._knee)
        if elapsed < straight * self.crossing:
            return self.start + math.copysign(elapsed / self.crossing, way)
        if not self.settling:
            return self.target
        left = math.exp(-(elapsed - straight * self.crossing) / self.settling)
        return self.target - math.copysign(abs(way) - straight, way) * left

    @property
    def _knee(self) -> float:
        """The distance to the target, in counts, at which the loop becomes slower than the slew limit."""
        return self.settling / self.crossing if self.crossing else math.inf

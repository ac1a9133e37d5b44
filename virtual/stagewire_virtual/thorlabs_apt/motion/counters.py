"""The position counter and the encoder counter (pages 28 and 29)."""

from __future__ import annotations

from stagewire_virtual.motion import Axis

__all__ = ["Counter"]


class Counter:
    """Counts from where it was last set, in 32 bits with a sign, and goes round beyond them.

    :param axis: whose places it counts; it is 0 where the stage stands.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self.set(0)

    def set(self, value: int) -> None:
        """Let it show ``value`` at the place of this instant."""
        self.origin = round(self._axis.place) - value

    @property
    def value(self) -> int:
        """What it shows at this instant."""
        counts = round(self._axis.place) - self.origin
        return (counts + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000

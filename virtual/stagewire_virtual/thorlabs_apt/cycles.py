"""The cycles of a solenoid driver, as a function of time (page 87)."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Cycles"]


@dataclass(frozen=True, slots=True)
class Cycles:
    """On for a time, off for a time, over and over.

    :param began: the instant at which the output was switched on, in nanoseconds.
    :param on: how long it is on in each cycle, in nanoseconds.
    :param off: how long it is off after that.
    :param number: how many cycles there are; None for cycles without end.
    """

    began: int
    on: int
    off: int
    number: int | None

    @property
    def end(self) -> int | None:
        """The instant at which the off time of the last cycle is over; None for never."""
        return None if self.number is None else self.began + self.number * (self.on + self.off)

    def active(self, now: int) -> bool:
        """Say whether the output is on at an instant before the end."""
        return (now - self.began) % (self.on + self.off) < self.on

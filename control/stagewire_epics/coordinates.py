"""User, dial and raw coordinates of a motor record, and its limits.

Dial coordinates are those of the controller, in the unit of the stage. User coordinates are the dial times a
direction plus an offset. Raw ones are counts.
"""

from __future__ import annotations

from dataclasses import dataclass

from stagewire.errors import LimitError
from stagewire_epics.records import PutRefusedError


@dataclass(slots=True)
class Coordinates:
    """The coordinates of an axis.

    :param resolution: length of a count.
    :param unit: unit of positions, for errors.
    :param travel: ends of the travel in dial coordinates; None: unknown.
    :param offset: user coordinate of the dial position 0.
    :param negative: whether user coordinates fall while dial coordinates rise.
    :param low: lower limit in dial coordinates.
    :param high: upper limit; both 0: unlimited.
    """

    resolution: float = 1.0
    unit: str = "counts"
    travel: tuple[float, float] | None = None
    offset: float = 0.0
    negative: bool = False
    low: float = 0.0
    high: float = 0.0

    @property
    def sign(self) -> int:
        """The direction: 1 or -1."""
        return -1 if self.negative else 1

    @property
    def limited(self) -> bool:
        """Whether there are limits."""
        return self.low < self.high

    @property
    def user_limits(self) -> tuple[float, float]:
        """The limits in user coordinates, the lower one first."""
        low, high = sorted((self.user(self.low), self.user(self.high)))
        return low, high

    def user(self, dial: float) -> float:
        """Return a dial position in user coordinates."""
        return self.sign * dial + self.offset

    def dial(self, user: float) -> float:
        """Return a user position in dial coordinates."""
        return self.sign * (user - self.offset)

    def counts(self, dial: float) -> int:
        """Return a dial position in counts."""
        return round(dial / self.resolution)

    def check(self, name: str, dial: float) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a target outside the limits.

        A target may be off by half a count, because user coordinates round.
        """
        spare = abs(self.resolution) / 2
        if self.limited and not self.low - spare <= dial <= self.high + spare:
            low, high = self.user_limits
            raise LimitError(
                f"{name}: {self.user(dial):g} {self.unit} is outside the limits, {low:g} to {high:g} "
                f"{self.unit}; nothing was sent"
            )

    def beyond(self, position: float, limit: float) -> bool:
        """Return whether a dial position is beyond one of the limits, by more than half a count."""
        spare = abs(self.resolution) / 2
        return position > limit + spare if limit == self.high else position < limit - spare

    def set_limits(self, name: str, low: float, high: float) -> None:
        """Set the limits in dial coordinates.

        Raise :class:`PutRefusedError` unless they are in order and within the travel, if that is known.
        """
        if low > high:
            raise PutRefusedError(
                f"{name}: the lower dial limit {low:g} {self.unit} is above the upper one, {high:g} "
                f"{self.unit}"
            )
        if low == high != 0:
            raise PutRefusedError(
                f"{name}: both dial limits would be {low:g} {self.unit}; put 0 into both for no limits"
            )
        if self.travel is not None:
            spare = abs(self.resolution) / 2
            if low == high or low < self.travel[0] - spare or high > self.travel[1] + spare:
                raise PutRefusedError(
                    f"{name}: dial limits {low:g} to {high:g} {self.unit} are not within the travel, "
                    f"{self.travel[0]:g} to {self.travel[1]:g} {self.unit}"
                )
        self.low, self.high = low, high

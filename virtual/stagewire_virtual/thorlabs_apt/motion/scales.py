"""What the values on the wire of a motor channel are in counts and seconds."""

from __future__ import annotations

from fractions import Fraction

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, Stage

__all__ = ["Scales"]

_FRACTION = 65536
"""Velocities and accelerations of DC servo controllers have 16 bits behind the point (page 14)."""


class Scales:
    """Factors from the wire to counts, for a stage on a unit.

    Each is 1 where it is not known: without a stage, and where the registry has no scale for stage and unit,
    a motor takes counts/s, counts/s² and counts/s³.

    :param stage: the stage, or None.
    :param unit: the name of the unit.
    """

    def __init__(self, stage: Stage | None, unit: str) -> None:
        self._stage = stage
        self._unit = unit
        self.counts_per_mm = self._of("position")
        """Counts of a millimetre, or None where they are not known."""
        velocity = self._counts("velocity")
        self.velocity = float(velocity or 1)
        """Counts/s for 1 on the wire."""
        self.acceleration = float(self._counts("acceleration") or self._same_cycle(velocity) or 1)
        """Counts/s² for 1 on the wire."""
        self.jerk = float(self._counts("jerk") or 1)
        """Counts/s³ for 1 on the wire."""
        self.status_velocity = float(self._counts("status_velocity") or 1)
        """Counts/s for 1 in the velocity of a DC status."""

    def _of(self, quantity: str) -> Fraction | None:
        """Return what the wire has for one unit of a quantity, or None where nobody knows it."""
        if self._stage is None:
            return None
        try:
            scale = self._stage.scale(quantity, self._unit)
        except UnknownScaleError:
            return None
        return scale.counts_per_unit if isinstance(scale, Scale) else None

    def _counts(self, quantity: str) -> Fraction | None:
        """Return how many counts, by the second as often as it may be, are 1 on the wire."""
        scale = self._of(quantity)
        return self.counts_per_mm / scale if self.counts_per_mm and scale else None

    @staticmethod
    def _same_cycle(velocity: Fraction | None) -> Fraction | None:
        """Return the scale of the acceleration that goes with that of the velocity.

        The registry has none for the Z8 on the TDC001, because later issues of the document round it. A
        controller has one all the same: velocities are counts in a servo cycle, and accelerations are what is
        added to them in every cycle (page 14).
        """
        return velocity**2 * _FRACTION if velocity else None

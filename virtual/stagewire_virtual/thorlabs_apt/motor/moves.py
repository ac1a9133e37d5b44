"""The ways in which a motor moves, from the place and the velocity that it has.

How fast depends on parameters (:class:`Paces`), whose values on the wire are scaled to counts and seconds
(:class:`Scales`).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, Stage
from stagewire_apt.enumerations import ProfileMode
from stagewire_virtual.profiles import Profile, run_on, s_curve, stop, trapezoid
from stagewire_virtual.thorlabs_apt.channel import Channel


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast to move.

    :param velocity: the top velocity, in counts/s.
    :param acceleration: of speeding up and of slowing down, in counts/s².
    :param jerk: in counts/s³ for S-curves, None for trapezoids.
    """

    velocity: float
    acceleration: float
    jerk: float | None = None

    @property
    def fault(self) -> str:
        """What keeps a motor from ever getting anywhere at this pace; empty if nothing does."""
        for name in ("velocity", "acceleration", "jerk"):
            value = getattr(self, name)
            if value is not None and value <= 0:
                return f"the {name} is not above zero"
        return ""


@dataclass(frozen=True, slots=True)
class GoTo:
    """Move to a place and rest there.

    Page 69 gives S-curves from rest to rest; whoever is in motion already goes on in a trapezoid.
    """

    place: float
    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan it from a place and a velocity."""
        top, acceleration, jerk = self.pace.velocity, self.pace.acceleration, self.pace.jerk
        if jerk is not None and not velocity:
            return s_curve(place, self.place, velocity=top, acceleration=acceleration, jerk=jerk)
        return trapezoid(
            place, self.place, velocity=top, acceleration=acceleration, initial_velocity=velocity
        )


@dataclass(frozen=True, slots=True)
class RunOn:
    """Move in a direction, 1 or -1, until something stops it."""

    direction: int
    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan it from a place and a velocity."""
        return run_on(
            place,
            self.direction * self.pace.velocity,
            acceleration=self.pace.acceleration,
            initial_velocity=velocity,
        )


@dataclass(frozen=True, slots=True)
class SlowDown:
    """Slow down and rest."""

    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan it from a place and a velocity."""
        return stop(place, acceleration=self.pace.acceleration, initial_velocity=velocity)


Move = GoTo | RunOn | SlowDown


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


class Paces:
    """The paces of a channel, each by the parameters of this instant.

    Start velocities are not heeded: they are "currently always zero" (pages 30 and 32).

    :param channel: whose parameters count.
    :param scales: what they are in counts.
    """

    def __init__(self, channel: Channel, scales: Scales) -> None:
        self._channel = channel
        self._scales = scales

    @property
    def move(self) -> Pace:
        """Of moves, by MOT_VELPARAMS (page 30); also of those at constant velocity.

        For these page 48 names MOT_SET_MOVEVELPARAMS, which has neither an id nor a layout.
        """
        return self._pace("MOT_VELPARAMS", "max_velocity", "acceleration")

    @property
    def jog(self) -> Pace:
        """Of jogs, by MOT_JOGPARAMS (page 32)."""
        return self._pace("MOT_JOGPARAMS", "jog_max_velocity", "jog_acceleration")

    @property
    def home(self) -> Pace:
        """Of homing, by MOT_HOMEPARAMS (page 37), which has no acceleration: that of the moves."""
        velocity = self._channel.parameter("MOT_HOMEPARAMS", "home_velocity")
        return Pace(velocity * self._scales.velocity, self.move.acceleration)

    def _pace(self, set_name: str, velocity: str, acceleration: str) -> Pace:
        parameter = self._channel.parameter
        jerk = None
        if parameter("MOT_PMDPROFILEMODEPARAMS", "mode") == ProfileMode.S_CURVE:
            jerk = parameter("MOT_PMDPROFILEMODEPARAMS", "jerk") * self._scales.jerk
        return Pace(
            parameter(set_name, velocity) * self._scales.velocity,
            parameter(set_name, acceleration) * self._scales.acceleration,
            jerk,
        )

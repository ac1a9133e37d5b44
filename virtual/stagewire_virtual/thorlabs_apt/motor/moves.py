"""The moves of a motor, from its present position and velocity.

:class:`Paces` determines their speed from parameters. :class:`Scales` converts the values on the wire to
counts and seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, ScaleConflict, Stage
from stagewire_apt.enumerations import ProfileMode
from stagewire_virtual.profiles import Profile, run_on, s_curve, stop, trapezoid
from stagewire_virtual.thorlabs_apt.channel import Channel


@dataclass(frozen=True, slots=True)
class Pace:
    """The speed of a move.

    :param velocity: the top velocity in counts/s.
    :param acceleration: the acceleration and deceleration in counts/s².
    :param jerk: the jerk of an S-curve in counts/s³; None for a trapezoid.
    """

    velocity: float
    acceleration: float
    jerk: float | None = None

    @property
    def fault(self) -> str:
        """Why no motor can move at this pace; empty if it can."""
        for name in ("velocity", "acceleration", "jerk"):
            value = getattr(self, name)
            if value is not None and value <= 0:
                return f"the {name} must be above 0"
        return ""


@dataclass(frozen=True, slots=True)
class GoTo:
    """A move to a place.

    An S-curve starts at rest (page 69); a motor in motion continues with a trapezoid.
    """

    place: float
    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan the move from a place and a velocity."""
        top, acceleration, jerk = self.pace.velocity, self.pace.acceleration, self.pace.jerk
        if jerk is not None and not velocity:
            return s_curve(place, self.place, velocity=top, acceleration=acceleration, jerk=jerk)
        return trapezoid(
            place, self.place, velocity=top, acceleration=acceleration, initial_velocity=velocity
        )


@dataclass(frozen=True, slots=True)
class RunOn:
    """A move in a direction, 1 or -1, until something stops it."""

    direction: int
    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan the move from a place and a velocity."""
        return run_on(
            place,
            self.direction * self.pace.velocity,
            acceleration=self.pace.acceleration,
            initial_velocity=velocity,
        )


@dataclass(frozen=True, slots=True)
class SlowDown:
    """A deceleration to rest."""

    pace: Pace

    def profile(self, place: float, velocity: float) -> Profile:
        """Plan the move from a place and a velocity."""
        return stop(place, acceleration=self.pace.acceleration, initial_velocity=velocity)


Move = GoTo | RunOn | SlowDown


_FRACTION = 65536
"""Velocities and accelerations of DC servo controllers have 16 fractional bits (page 14)."""


_BELIEVED: Final = ("vendor", "since_hardware_3")
"""The sources that decide if the sources of a scale contradict each other.

The vendor's programs drive these stages. A virtual LTS reports hardware version 3.
"""


class Scales:
    """Factors from values on the wire to counts, for a stage on a unit.

    An unknown factor is 1: without a stage, or without a scale in the registry for this stage and unit,
    values are counts/s, counts/s² and counts/s³.

    :param stage: the stage, or None.
    :param unit: the name of the unit.
    """

    def __init__(self, stage: Stage | None, unit: str) -> None:
        self._stage = stage
        self._unit = unit
        self.counts_per_mm = self._of("position")
        """Counts per millimetre, or per degree of a rotary stage; None if unknown."""
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
        """Return the value on the wire for one unit of a quantity; None if unknown."""
        if self._stage is None:
            return None
        try:
            scale = self._stage.scale(quantity, self._unit)
        except UnknownScaleError:
            return None
        if isinstance(scale, ScaleConflict):
            scale = next(scale.scales[name] for name in _BELIEVED if name in scale.scales)
        return scale.counts_per_unit if isinstance(scale, Scale) else None

    def _counts(self, quantity: str) -> Fraction | None:
        """Return the counts (or counts/s, and so on) for 1 on the wire; None if unknown."""
        scale = self._of(quantity)
        return self.counts_per_mm / scale if self.counts_per_mm and scale else None

    @staticmethod
    def _same_cycle(velocity: Fraction | None) -> Fraction | None:
        """Return the scale of the acceleration that corresponds to that of the velocity.

        The registry has none for the Z8 on the TDC001, because later issues of the document round it. It can
        be derived: velocities are counts per servo cycle, and accelerations are the change of velocity per
        cycle (page 14).
        """
        return velocity**2 * _FRACTION if velocity else None


class Paces:
    """The paces of a channel, from its present parameters.

    Start velocities are ignored: they are "currently always zero" (pages 30 and 32).

    :param channel: the channel.
    :param scales: the scales of its parameters.
    """

    def __init__(self, channel: Channel, scales: Scales) -> None:
        self._channel = channel
        self._scales = scales

    @property
    def move(self) -> Pace:
        """The pace of moves, including velocity moves, from MOT_VELPARAMS (page 30).

        For velocity moves page 48 names MOT_SET_MOVEVELPARAMS, which has neither an id nor a layout.
        """
        return self._pace("MOT_VELPARAMS", "max_velocity", "acceleration")

    @property
    def jog(self) -> Pace:
        """The pace of jogs, from MOT_JOGPARAMS (page 32)."""
        return self._pace("MOT_JOGPARAMS", "jog_max_velocity", "jog_acceleration")

    @property
    def home(self) -> Pace:
        """The pace of homing, from MOT_HOMEPARAMS (page 37), with the acceleration of moves."""
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

"""The ways in which a motor moves, from the place and the velocity that it has."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_virtual.motion import Profile, run_on, s_curve, stop, trapezoid

__all__ = ["GoTo", "Pace", "RunOn", "SlowDown", "Way"]


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


Way = GoTo | RunOn | SlowDown

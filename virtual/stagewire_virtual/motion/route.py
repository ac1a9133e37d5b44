"""What planners put profiles together with."""

from __future__ import annotations

from stagewire_virtual.motion.profile import Profile, Segment

__all__ = ["Route"]


class Route:
    """Segments that are laid one behind the other, each beginning where the last one ended."""

    def __init__(self, position: float, velocity: float = 0.0) -> None:
        self.time = 0.0
        self.position = position
        self.velocity = velocity
        self._segments: list[Segment] = []

    def add(self, duration: float, acceleration: float = 0.0, jerk: float = 0.0) -> None:
        """Go on for ``duration`` seconds; nothing is added for none."""
        if duration <= 0:
            return
        segment = Segment(self.time, duration, self.position, self.velocity, acceleration, jerk)
        self._segments.append(segment)
        self.time += duration
        self.position = segment.position_after(duration)
        self.velocity = segment.velocity_after(duration)

    def profile(self, end: float | None) -> Profile:
        """Return what has been laid; ``end`` is where it comes to rest, without the rounding on the way."""
        return Profile(self._segments, end)

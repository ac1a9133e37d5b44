"""A motion from its first to its last instant, as a function of time."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_virtual.clock import SECOND

__all__ = ["Profile", "Segment"]

_FOREVER = 1 << 62  # nanoseconds, 146 years: what comes later does not come


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch of constant jerk; position, velocity and acceleration are those of its beginning.

    :param begin: when it begins, in seconds since the profile began.
    :param duration: how long it lasts, in seconds; infinite in the last one of a motion that runs on.
    """

    begin: float
    duration: float
    position: float
    velocity: float
    acceleration: float = 0.0
    jerk: float = 0.0

    def position_after(self, seconds: float) -> float:
        """Return the position, ``seconds`` after the segment began."""
        slope = self.acceleration / 2 + self.jerk * seconds / 6
        return self.position + (self.velocity + slope * seconds) * seconds

    def velocity_after(self, seconds: float) -> float:
        """Return the velocity, ``seconds`` after the segment began."""
        return self.velocity + (self.acceleration + self.jerk * seconds / 2) * seconds


class Profile:
    """A planned motion: segments, one after the other. Immutable.

    Time is counted in nanoseconds from its beginning. No segment has a velocity of both signs.

    :param segments: its stretches; none for a motion that is over when it begins.
    :param end: where it comes to rest, exactly; None for a motion that runs on.
    """

    __slots__ = ("_begins", "_last", "duration", "end", "segments")

    def __init__(self, segments: Sequence[Segment], end: float | None) -> None:
        self.segments = tuple(segments)
        self.end = end
        self._begins = [segment.begin for segment in self.segments]
        self.duration: int | None = None
        """How long it lasts, to the nearest nanosecond; None when it runs on."""
        if end is not None:
            last = self.segments[-1] if self.segments else Segment(0.0, 0.0, end, 0.0)
            self.duration = round((last.begin + last.duration) * SECOND)

    def position(self, time: int) -> float:
        """Return the position at a time; after its duration the very end."""
        if self.duration is not None and time >= self.duration:
            return self.end  # type: ignore[return-value]  # it has one, because it has a duration
        segment, seconds = self._segment(time)
        return segment.position_after(seconds)

    def velocity(self, time: int) -> float:
        """Return the velocity at a time; zero after its duration."""
        if self.duration is not None and time >= self.duration:
            return 0.0
        segment, seconds = self._segment(time)
        return segment.velocity_after(seconds)

    def acceleration(self, time: int) -> float:
        """Return the acceleration at a time; zero after its duration."""
        if self.duration is not None and time >= self.duration:
            return 0.0
        segment, seconds = self._segment(time)
        return segment.acceleration + segment.jerk * seconds

    def reaches(self, bound: float, direction: int) -> int | None:
        """Return the first time at which it moves on from ``bound`` or beyond; None if it never does.

        :param direction: of the motion that counts: 1 for upwards, with what is beyond above it, or -1.
        """
        for segment in self.segments:
            if math.isinf(segment.duration):
                towards = segment.velocity * direction
            else:
                last = segment.position_after(segment.duration)
                towards = (last - segment.position) * direction
            if towards <= 0:
                continue
            missing = (bound - segment.position) * direction
            if missing <= 0:
                return math.ceil(segment.begin * SECOND)
            if math.isinf(segment.duration):
                time = math.ceil((segment.begin + missing / towards) * SECOND)
                return time if time < _FOREVER else None
            if missing <= towards:
                return self._crossing(segment, bound, direction)
        return None

    def _segment(self, time: int) -> tuple[Segment, float]:
        """Return the segment that a time lies in, and the seconds since it began."""
        seconds = time / SECOND
        segment = self.segments[bisect_right(self._begins, seconds) - 1]
        return segment, seconds - segment.begin

    def _crossing(self, segment: Segment, bound: float, direction: int) -> int:
        """Return the first nanosecond of a segment that crosses ``bound`` at which it has been crossed."""
        before = math.floor(segment.begin * SECOND)
        beyond = math.ceil((segment.begin + segment.duration) * SECOND)
        while beyond - before > 1:
            middle = (before + beyond) // 2
            reached = segment.position_after(middle / SECOND - segment.begin)
            if (reached - bound) * direction >= 0:
                beyond = middle
            else:
                before = middle
        return beyond

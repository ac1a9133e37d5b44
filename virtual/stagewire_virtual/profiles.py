"""Motion profiles: whole motions as functions of time.

The planners make two kinds of profiles: with constant acceleration (to a target, without end, and to a stop),
and with limited jerk (seven segments, from rest to rest).

The module is independent of protocols, messages and units of length. Positions are counts, velocities
counts/s, accelerations counts/s², jerks counts/s³, and times whole nanoseconds.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_virtual.clock import SECOND

_FOREVER = 1 << 62  # nanoseconds, 146 years: a later time counts as never


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a profile with constant jerk; position, velocity and acceleration are those at its beginning.

    :param begin: its beginning, in seconds since the profile began.
    :param duration: its duration in seconds; infinite for the last segment of a motion without end.
    """

    begin: float
    duration: float
    position: float
    velocity: float
    acceleration: float = 0.0
    jerk: float = 0.0

    def position_after(self, seconds: float) -> float:
        """Return the position ``seconds`` after the beginning of the segment."""
        slope = self.acceleration / 2 + self.jerk * seconds / 6
        return self.position + (self.velocity + slope * seconds) * seconds

    def velocity_after(self, seconds: float) -> float:
        """Return the velocity ``seconds`` after the beginning of the segment."""
        return self.velocity + (self.acceleration + self.jerk * seconds / 2) * seconds


class Profile:
    """A planned motion of consecutive segments. Immutable.

    Times are nanoseconds from its beginning. The velocity does not change its sign within a segment.

    :param segments: its segments; empty for a motion of no duration.
    :param end: the exact position at which it comes to rest; None for a motion without end.
    """

    __slots__ = ("_begins", "_last", "duration", "end", "segments")

    def __init__(self, segments: Sequence[Segment], end: float | None) -> None:
        self.segments = tuple(segments)
        self.end = end
        self._begins = [segment.begin for segment in self.segments]
        self.duration: int | None = None
        """Its duration, to the nearest nanosecond; None for a motion without end."""
        if end is not None:
            last = self.segments[-1] if self.segments else Segment(0.0, 0.0, end, 0.0)
            self.duration = round((last.begin + last.duration) * SECOND)

    def position(self, time: int) -> float:
        """Return the position at a time; after the duration, exactly the end."""
        if self.duration is not None and time >= self.duration:
            return self.end  # type: ignore[return-value]  # a profile with a duration has an end
        segment, seconds = self._segment(time)
        return segment.position_after(seconds)

    def velocity(self, time: int) -> float:
        """Return the velocity at a time; zero after the duration."""
        if self.duration is not None and time >= self.duration:
            return 0.0
        segment, seconds = self._segment(time)
        return segment.velocity_after(seconds)

    def acceleration(self, time: int) -> float:
        """Return the acceleration at a time; zero after the duration."""
        if self.duration is not None and time >= self.duration:
            return 0.0
        segment, seconds = self._segment(time)
        return segment.acceleration + segment.jerk * seconds

    def reaches(self, bound: float, direction: int) -> int | None:
        """Return the first time at which it moves in ``direction`` at ``bound`` or beyond; None if never.

        :param direction: 1 for upwards, where beyond means above, or -1 for downwards.
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
        """Return the segment at a time, and the seconds since the segment began."""
        seconds = time / SECOND
        segment = self.segments[bisect_right(self._begins, seconds) - 1]
        return segment, seconds - segment.begin

    def _crossing(self, segment: Segment, bound: float, direction: int) -> int:
        """Return the first nanosecond at which a segment has crossed ``bound``."""
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


class Route:
    """A builder of profiles: each segment that is added begins where the previous one ended."""

    def __init__(self, position: float, velocity: float = 0.0) -> None:
        self.time = 0.0
        self.position = position
        self.velocity = velocity
        self._segments: list[Segment] = []

    def add(self, duration: float, acceleration: float = 0.0, jerk: float = 0.0) -> None:
        """Add a segment of ``duration`` seconds, if that is above 0."""
        if duration <= 0:
            return
        segment = Segment(self.time, duration, self.position, self.velocity, acceleration, jerk)
        self._segments.append(segment)
        self.time += duration
        self.position = segment.position_after(duration)
        self.velocity = segment.velocity_after(duration)

    def profile(self, end: float | None) -> Profile:
        """Return the profile; ``end`` is its exact final position, free of accumulated rounding."""
        return Profile(self._segments, end)


def s_curve(
    position: float, target: float, *, velocity: float, acceleration: float, jerk: float
) -> Profile:
    """Plan a move from rest to rest at ``target`` with limited jerk.

    Three segments lead to the top velocity, or to the highest velocity that the distance allows. One segment
    keeps it, and three lead to rest.

    :param velocity: the top velocity, above zero.
    :param acceleration: the greatest acceleration, above zero; short moves do not reach it.
    :param jerk: the rate at which the acceleration changes, above zero.
    """
    distance = abs(target - position)
    direction = math.copysign(1.0, target - position)
    route = Route(position)
    if distance:
        peak = min(velocity, _peak(distance, acceleration, jerk))
        # The jerk lasts until the greatest acceleration, or for half of a ramp that does not reach it.
        rise = min(acceleration / jerk, math.sqrt(peak / jerk))
        top = jerk * rise
        constant = max(peak / top - rise, 0.0)
        cruise = max(distance / peak - (2 * rise + constant), 0.0)
        up, down = direction * jerk, -direction * jerk
        route.add(rise, 0.0, up)
        route.add(constant, direction * top)
        route.add(rise, direction * top, down)
        route.add(cruise)
        route.add(rise, 0.0, down)
        route.add(constant, -direction * top)
        route.add(rise, -direction * top, up)
    return route.profile(target)


def _peak(distance: float, acceleration: float, jerk: float) -> float:
    """Return the highest velocity over a distance that acceleration and jerk allow.

    A ramp to v lasts v/a + a/j. If v is below a²/j, it never reaches a and lasts 2√(v/j). Both ramps together
    cover v times the duration of one.
    """
    knee = acceleration**2 / jerk
    peak = (math.sqrt(knee**2 + 4 * acceleration * distance) - knee) / 2
    return peak if peak >= knee else (distance**2 * jerk / 4) ** (1 / 3)


def trapezoid(
    position: float,
    target: float,
    *,
    velocity: float,
    acceleration: float,
    initial_velocity: float = 0.0,
) -> Profile:
    """Plan a move to rest at ``target``: accelerate, continue at the top velocity, decelerate.

    A motion that is too close to stop in time overshoots the target and returns. A motion away from the
    target stops first. A motion above the top velocity slows down to it.

    :param velocity: the top velocity, above zero.
    :param acceleration: the acceleration and deceleration, above zero.
    :param initial_velocity: the velocity at the beginning, with a sign.
    """
    route = Route(position, initial_velocity)
    beyond = target - _at_rest(route, acceleration)
    direction = math.copysign(1.0, beyond)
    if route.velocity * direction < 0 or not beyond:
        _brake(route, acceleration)
    distance = abs(target - route.position)
    if beyond and distance:
        first = abs(route.velocity)
        peak = math.sqrt(acceleration * distance + first**2 / 2)
        peak = min(max(peak, first), velocity)
        ramps = (abs(peak**2 - first**2) + peak**2) / (2 * acceleration)
        change = direction * (peak - first)  # against the direction if it is too fast
        route.add(abs(change) / acceleration, math.copysign(acceleration, change))
        route.velocity = direction * peak
        route.add(max(distance - ramps, 0.0) / peak)
        route.add(peak / acceleration, -direction * acceleration)
    return route.profile(target)


def run_on(
    position: float, velocity: float, *, acceleration: float, initial_velocity: float = 0.0
) -> Profile:
    """Plan a motion that changes to ``velocity``, which has a sign, and has no end."""
    route = Route(position, initial_velocity)
    if route.velocity * velocity < 0:
        _brake(route, acceleration)
    change = velocity - route.velocity
    route.add(abs(change) / acceleration, math.copysign(acceleration, change))
    route.velocity = velocity
    route.add(math.inf)
    return route.profile(None)


def stop(position: float, *, acceleration: float, initial_velocity: float) -> Profile:
    """Plan a deceleration to rest."""
    route = Route(position, initial_velocity)
    _brake(route, acceleration)
    return route.profile(route.position)


def _at_rest(route: Route, acceleration: float) -> float:
    """Return the position at which a deceleration from now on would end."""
    way = route.velocity**2 / (2 * acceleration)
    return route.position + math.copysign(way, route.velocity)


def _brake(route: Route, acceleration: float) -> None:
    """Add a deceleration to rest."""
    duration = abs(route.velocity) / acceleration
    route.add(duration, -math.copysign(acceleration, route.velocity))
    route.velocity = 0.0

"""Motion profiles: a motion from its first to its last instant, as a function of time.

Planners make profiles of two kinds: of constant acceleration (to a target, on and on, and to a stop), and of
limited jerk (seven segments, from rest to rest).

Knows no protocol, no message and no unit of length: positions are counts, velocities counts/s, accelerations
counts/s², jerks counts/s³, and times whole nanoseconds.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_virtual.clock import SECOND

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


def s_curve(
    position: float, target: float, *, velocity: float, acceleration: float, jerk: float
) -> Profile:
    """Plan the way from rest to rest at ``target`` with an acceleration that changes by ``jerk`` only.

    Three segments to the top velocity, or to what the distance allows, one at it, three to rest.

    :param velocity: the top velocity, above zero.
    :param acceleration: the greatest acceleration, above zero; small changes of velocity do not reach it.
    :param jerk: the change of acceleration by time, above zero.
    """
    distance = abs(target - position)
    direction = math.copysign(1.0, target - position)
    route = Route(position)
    if distance:
        peak = min(velocity, _peak(distance, acceleration, jerk))
        # The jerk lasts until the top acceleration is reached, or for half of a ramp that never reaches it.
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
    """Return the velocity that is reached over a distance when nothing else limits it.

    A ramp to v lasts v/a + a/j, and 2√(v/j) when it never reaches a, which is so below a²/j. Both ramps
    together cover v times the time of one.
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
    """Plan the way to ``target``, there to rest: accelerate, go on at the top velocity, decelerate.

    Whoever cannot stop in time goes beyond the target and comes back, whoever moves away stops first, and
    whoever is too fast slows down to the top velocity.

    :param velocity: the top velocity, above zero.
    :param acceleration: of speeding up and of slowing down, above zero.
    :param initial_velocity: at the beginning, with its sign.
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
        change = direction * (peak - first)  # downwards for who is too fast
        route.add(abs(change) / acceleration, math.copysign(acceleration, change))
        route.velocity = direction * peak
        route.add(max(distance - ramps, 0.0) / peak)
        route.add(peak / acceleration, -direction * acceleration)
    return route.profile(target)


def run_on(
    position: float, velocity: float, *, acceleration: float, initial_velocity: float = 0.0
) -> Profile:
    """Plan a motion that changes to ``velocity``, which has a sign, and goes on for ever."""
    route = Route(position, initial_velocity)
    if route.velocity * velocity < 0:
        _brake(route, acceleration)
    change = velocity - route.velocity
    route.add(abs(change) / acceleration, math.copysign(acceleration, change))
    route.velocity = velocity
    route.add(math.inf)
    return route.profile(None)


def stop(position: float, *, acceleration: float, initial_velocity: float) -> Profile:
    """Plan to slow down to rest."""
    route = Route(position, initial_velocity)
    _brake(route, acceleration)
    return route.profile(route.position)


def _at_rest(route: Route, acceleration: float) -> float:
    """Return where it would come to rest if it slowed down from now on."""
    way = route.velocity**2 / (2 * acceleration)
    return route.position + math.copysign(way, route.velocity)


def _brake(route: Route, acceleration: float) -> None:
    """Slow down, and stand."""
    duration = abs(route.velocity) / acceleration
    route.add(duration, -math.copysign(acceleration, route.velocity))
    route.velocity = 0.0

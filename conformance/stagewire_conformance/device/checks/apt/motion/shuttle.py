"""Moves back and forth over the same distance, measured by the positions and times of the messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis
from stagewire_conformance.device.checks.apt.motion.course import (
    Point,
    beyond,
    points_of,
    steady_speed,
    top_speed,
    until_steady,
)
from stagewire_conformance.device.checks.apt.motion.moves import absolute, distances
from stagewire_conformance.device.checks.apt.motion.moves import beyond as too_far
from stagewire_conformance.device.checks.apt.motion.watch import watch

if TYPE_CHECKING:
    from stagewire import FramedMessage

_LONGEST: Final = 15.0
"""Seconds after which a slow move is stopped; with correct firmware it takes a few."""
_MOST_TIMES: Final = 20.0
"""The maximum factor by which a distance is extended."""


@dataclass(frozen=True)
class Course:
    """A measured move.

    :param seconds: from the command to the end message.
    :param speed: the highest speed in counts/s.
    :param steady: the average speed over the middle half of the way.
    :param way: its distance in counts.
    :param reported: the highest velocity in a status, without its sign; None if statuses have none.
    :param over: the counts by which it went beyond its last position.
    :param ramp: the counts after which it had nine tenths of its highest speed.
    """

    seconds: float
    speed: float
    steady: float
    way: int
    reported: int | None
    over: int
    ramp: int

    @property
    def ramp_of_triangle(self) -> float:
        """The acceleration in counts/s² of a move that only sped up and slowed down."""
        return 4 * self.way / self.seconds**2


@dataclass
class Shuttle:
    """Moves of motors back and forth over constant distances.

    :param ways: the distance of each motor, with a sign.
    :param begins: the positions at which the motors begin, if not at their starts.
    :param over: the counts by which a motor goes beyond its targets to correct the backlash.
    """

    ways: Mapping[Axis, int]
    begins: Mapping[Axis, int] = field(default_factory=dict)
    over: Mapping[Axis, int] = field(default_factory=dict)
    courses: dict[Axis, list[Course]] = field(default_factory=dict)
    _away: dict[Axis, bool] = field(default_factory=dict)

    def speeds(self, axes: Sequence[Axis]) -> Mapping[Axis, float]:
        """Move once, and return the highest speed of each motor."""
        return {axis: course.speed for axis, course in self._go(axes).items()}

    def durations(self, axes: Sequence[Axis]) -> Mapping[Axis, float]:
        """Move once, and return the seconds that each motor needed."""
        return {axis: course.seconds for axis, course in self._go(axes).items()}

    def overshoots(self, axes: Sequence[Axis]) -> Mapping[Axis, int]:
        """Move once, and return the counts by which each motor went beyond its last position."""
        return {axis: course.over for axis, course in self._go(axes).items()}

    def message(self, axis: Axis) -> FramedMessage:
        """Return the command for the next move of a motor."""
        return absolute(axis, self._target(axis)).message

    def _target(self, axis: Axis) -> int:
        return self.begins.get(axis, axis.start) + (0 if self._away.get(axis) else self.ways[axis])

    def _way(self, axis: Axis, position: int) -> int:
        """Return the distance of the next move of a motor."""
        return self._target(axis) - position

    def _go(self, axes: Sequence[Axis]) -> dict[Axis, Course]:
        if not axes:
            return {}
        axes[0].trial.depends_on(Cause(COMPLETED, "early"))
        starts = {axis: axis.status() for axis in axes}
        ways = {axis: self._way(axis, starts[axis].position) for axis in axes}
        places = {axis: status.position for axis, status in starts.items()}
        reach = {
            axis: way + (self.over.get(axis, 0) if way > 0 else -self.over.get(axis, 0))
            for axis, way in ways.items()
        }
        began = {}
        for axis in axes:
            axis.send(self.message(axis))
            began[axis] = axis.trial.line.now
        seen = watch(axes, dict.fromkeys(axes, _LONGEST), strays=too_far(places, reach))
        found = {}
        for axis in axes:
            each = seen[axis]
            self._away[axis] = not self._away.get(axis, False)
            if each.strayed is not None or not each.ends:
                axis.halt()
                axis.trial.inconclusive(
                    f"{axis.text}: a move did not end with {COMPLETED}, so its speed was not measured"
                )
                continue
            end = each.ends[0]
            points = [Point(began[axis], starts[axis].position), *points_of(each.statuses)]
            points = [point for point in points if point.time <= end.time]
            position = getattr(end.message, "position", None)
            if position is not None and not axis.trial.causes.check_of(Cause(end.name, "position")):
                points.append(Point(end.time, position))
            velocities = [abs(s.velocity) for s in each.statuses if s.velocity is not None]
            course = Course(
                seconds=end.time - began[axis],
                speed=top_speed(points),
                steady=steady_speed(points),
                way=abs(points[-1].position - points[0].position),
                reported=max(velocities, default=None),
                over=beyond(points, points[0].position, points[-1].position),
                ramp=until_steady(points),
            )
            found[axis] = course
            self.courses.setdefault(axis, []).append(course)
        return found


def distances_lasting(axes: Sequence[Axis], seconds: float) -> dict[Axis, int]:
    """Return a distance for each motor that takes about so many seconds.

    A motor of unknown speed is moved once, there and back, to measure it, unless an earlier check has
    measured it. End the check if a motor is too slow.
    """
    ways = distances(axes, seconds)
    for axis, way in ways.items():
        axis.pace.bound(way)
    unknown = [axis for axis in axes if not axis.pace.known]
    shuttle = Shuttle({axis: ways[axis] for axis in unknown if axis.pace.measured is None})
    took = shuttle.durations(list(shuttle.ways))
    shuttle.durations(list(took))
    for axis in unknown:
        longest = abs(ways[axis])
        if axis.pace.measured is not None:
            longest = max(longest, int(axis.pace.measured * seconds))
        elif axis in took:
            longest = int(longest * min(_MOST_TIMES, max(1.0, seconds / max(took[axis], 0.01))))
        way = 1 if ways[axis] > 0 else -1
        ways[axis] = way * min(longest, axis.room(axis.start, way))
    return ways


class JogShuttle(Shuttle):
    """Jogs of motors forward and in reverse by their steps."""

    def message(self, axis: Axis) -> FramedMessage:
        """Return the command for the next jog of a motor."""
        direction = MoveDirection.REVERSE if self._away.get(axis) else MoveDirection.FORWARD
        return m.MotMoveJog(axis.channel, direction)

    def _way(self, axis: Axis, position: int) -> int:
        """Return the step of a jog, which begins anywhere."""
        return self.ways[axis]

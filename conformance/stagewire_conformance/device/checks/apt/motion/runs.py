"""Runs: motions without a target, which only a stop ends. They are started, watched, stopped, and judged.

Before a motor is started, it is made sure that it can be stopped in time: it runs so slowly that it would
need more than two seconds to the end of the range, and stops within a quarter of the rest. It is stopped as
soon as it has been seen to run. No page states in which direction positions rise, so it starts at a position
with room both up and down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from stagewire_apt.enumerations import MoveDirection, StopMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_command, rule_of_set
from stagewire_conformance.device.checks.apt.motion.apart import start
from stagewire_conformance.device.checks.apt.motion.axis import HELD, STOPPED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.course import (
    Point,
    is_speeding_up,
    points_of,
    speeds,
    top_speed,
)
from stagewire_conformance.device.checks.apt.motion.early_ends import judge_over
from stagewire_conformance.device.checks.apt.motion.judgement import (
    judge_course,
    judge_end,
    judge_rest,
)
from stagewire_conformance.device.checks.apt.motion.pace import Pace, jog_pace_of, pace_of
from stagewire_conformance.device.checks.apt.motion.parameters import change, present
from stagewire_conformance.device.checks.apt.motion.stopping import (
    StoppedMotion,
    judge_modes,
    judge_stopping,
    need_stops,
)
from stagewire_conformance.device.checks.apt.motion.watch import Watched, is_outside, watch

if TYPE_CHECKING:
    from stagewire import FramedMessage

_RUNNING: Final = 0.25
"""The approximate duration of a run in seconds."""
_LATE: Final = 0.25
"""Seconds by which a stop may be late; the range leaves room for the motion in that time."""
_FASTER: Final = 1.4
"""The ratio of the speed of a run to the velocity that is set from which it does not obey it."""
_RAMPING: Final = 0.6
"""The ratio of the speed in the first tenth of a second to the highest one below which a ramp is visible."""
_RAMP: Final = 0.05
"""Seconds of the highest speed that such a ramp at least covers."""
_TELLING: Final = 64
"""Counts by which a profiled stop must be longer so that the modes can be compared."""
LEAST_ROOM: Final = 64
"""Counts of room required in a direction."""


def room_for(axis: Axis, pace: Pace) -> int:
    """Return the counts of room for a run both up and down; enough to keep the velocity, if possible."""
    half = axis.half(LEAST_ROOM)
    enough = 2 * pace.velocity * max(1.0, pace.velocity / pace.acceleration)
    return max(LEAST_ROOM, int(min(half, math.ceil(enough))))


def slow_down(
    axis: Axis,
    room: int,
    pace: Pace | None = None,
    setting: str = "MOT_SET_VELPARAMS",
    name: str = "max_velocity",
) -> float:
    """Slow a motor down so that it needs at least two seconds for a number of counts.

    Return the velocity in counts/s that it then does not exceed.

    :param pace: the present pace; by default the fastest that moves may have.
    :param setting: the message that sets the velocity.
    :param name: its field.
    """
    pace = pace or axis.pace.fastest
    slow = min(pace.velocity, room / 2, math.sqrt(room * pace.acceleration / 2))
    told: int = present(axis, setting)[name]
    lower = max(1, int(told * slow / pace.velocity))
    if lower < told:
        change(axis, setting, at_most=name, **{name: lower})
    return slow


WAYS: Final = (
    (MoveDirection.FORWARD, StopMode.PROFILED),
    (MoveDirection.REVERSE, StopMode.IMMEDIATE),
)
"""The directions of two runs, with the mode in which each is stopped."""


@dataclass
class Run:
    """A run of a motor.

    :param message: the command.
    :param velocity: the velocity that it does not exceed, in counts/s.
    :param acceleration: its acceleration in counts/s².
    :param jogging: whether the status must report a jog.
    :param pace: the pace of the command; that of moves by default.
    :param mode: how it is stopped.
    :param telling: the counts that show that the motor runs on. A motor that is slower than its velocity
        allows is stopped after them.
    """

    axis: Axis
    direction: MoveDirection
    message: FramedMessage
    velocity: float
    acceleration: float
    jogging: bool = False
    pace: Pace | None = None
    telling: int | None = None
    start: int = 0
    mode: StopMode = StopMode.PROFILED

    @property
    def told(self) -> str:
        """The command, for sentences."""
        return f"{self.message.layout.message} {self.direction.name.lower()}"

    @property
    def rule(self) -> str:
        """The rule that it continues until a stop."""
        return "jog-continuous" if self.jogging else "velocity-move-until-stop"

    @property
    def too_fast(self) -> Cause:
        """The defect that the velocity of the run has no effect."""
        if self.jogging:
            return Cause("MOT_SET_JOGPARAMS", "jog_max_velocity")
        return Cause("MOT_SET_VELPARAMS", "max_velocity")

    @property
    def due(self) -> float:
        """The velocity in counts/s that is set; infinite if it has no scale, and no move has shown one."""
        read = jog_pace_of if self.jogging else pace_of
        pace = read(self.axis.trial, self.axis.place, self.axis.channel)
        return pace.fastest.velocity if pace.known else pace.measured or math.inf

    @property
    def rule_of_direction(self) -> str:
        """The rule about its direction."""
        return "jog-direction-values" if self.jogging else "velocity-direction-values"

    @property
    def cause(self) -> Cause:
        """The cause of a run that does not go where it should."""
        return Cause(self.message.layout.message, "continuous" if self.jogging else EFFECT)

    @property
    def stopping(self) -> float:
        """The counts that the motor may need to come to rest."""
        return self.velocity * (_LATE + self.velocity / self.acceleration / 2)

    @property
    def free(self) -> float:
        """The counts after which the motor must be stopped."""
        up, down = self.axis.high - self.start, self.start - self.axis.low
        room = {1: up, -1: down, 0: min(up, down)}
        return room[self.axis.way_of(self.direction)] - self.stopping

    @property
    def enough(self) -> float:
        """The counts after which the motor is stopped."""
        return min(self.velocity * _RUNNING + self.stopping, self.free)

    @property
    def latest(self) -> float:
        """The seconds after which the motor must be stopped even if its position is unknown."""
        ramp = self.velocity / self.acceleration
        if self.free < self.velocity * ramp / 2:
            return math.sqrt(2 * self.free / self.acceleration)
        return self.free / self.velocity + ramp / 2

    @property
    def limit(self) -> float:
        """The seconds that the run may take: longer if the motor may be slower than the velocity bounds."""
        pace = self.pace or self.axis.pace
        slower = max(1.0, pace.fastest.velocity / pace.velocity)
        return 10 * _RUNNING * slower + pace.fastest.limit(int(self.stopping))

    def gone(self, status: Status) -> int:
        """Return how far the motor has gone, as an absolute distance if its direction is unknown."""
        moved = status.position - self.start
        return moved * self.axis.way_of(self.direction) if self.axis.clockwise else abs(moved)


@dataclass(frozen=True)
class Ran:
    """A run that was stopped.

    :param points: the positions of the motor until it was stopped.
    :param rest: its position at rest after that.
    """

    points: list[Point]
    rest: int

    @property
    def stopped(self) -> StoppedMotion:
        """The stop of the run."""
        start, last = self.points[0].position, self.points[-1].position
        return StoppedMotion(last - start, abs(self.rest - last), is_speeding_up(self.points))

    @property
    def slows_down_visibly(self) -> bool:
        """Whether it sped up so slowly that a profiled stop differs visibly from an immediate one."""
        first, *_, fastest = speeds(self.points)[:1] + sorted(speeds(self.points))
        return first < _RAMPING * fastest and fastest * _RAMP > _TELLING


def judge_modes_of_runs(runs: Sequence[tuple[Run, Ran]]) -> None:
    """Compare the profiled and the immediate stop of each motor, if both were made after a visible ramp."""
    stopped = {(run.axis, run.mode): (run, ran) for run, ran in runs if ran.slows_down_visibly}
    for (axis, mode), (run, ran) in stopped.items():
        other = stopped.get((axis, StopMode.IMMEDIATE))
        if mode is StopMode.PROFILED and other is not None:
            command = run.message.layout.message
            # A jog also has a stop mode among its parameters (page 32).
            judge_modes(
                axis, f" in {command}", other[1].stopped, ran.stopped, certain=not run.jogging
            )


def run_all(runs: Sequence[Run], *, alone: bool = False) -> dict[Axis, Ran] | None:
    """Run motors together, stop each, and judge the reaction.

    Return the motion of each motor until it was stopped; None if not all followed their commands.

    :param alone: whether to start the first motor alone, to see whether the others obey its command.
    """
    by_axis = {run.axis: run for run in runs}
    need_stops(list(by_axis))
    for run in runs:  # nothing else bounds a run than its velocity and its stop
        run.axis.trial.depends_on(Cause("MOT_MOVE_STOP", EFFECT), run.too_fast)
        run.start = run.axis.status().position
    if any(run.free < LEAST_ROOM for run in runs):  # the first run ended where it should not have
        return None

    def enough(axis: Axis, status: Status) -> bool:
        run = by_axis[axis]
        gone = run.gone(status)
        late = axis.trial.line.now - began[axis].time > 4 * _RUNNING
        told = late and run.telling is not None and gone >= run.telling
        return told or gone >= run.enough or -gone > run.stopping

    times = start({run.axis: run.message for run in runs}, first_alone=alone)
    began = {run.axis: Point(times[run.axis], run.start) for run in runs}

    def strays(axis: Axis, status: Status) -> bool:
        run = by_axis[axis]
        too_far = run.enough + 2 * run.stopping + HELD
        return is_outside(axis, status) or abs(run.gone(status)) > too_far

    limits = {run.axis: run.limit for run in runs}
    now = runs[0].axis.trial.line.now
    latest = {run.axis: run.latest - (now - times[run.axis]) for run in runs}
    mode = runs[0].mode
    seen = watch(list(by_axis), limits, stop=enough, mode=mode, strays=strays, deadlines=latest)
    done = [_judge(run, seen[run.axis]) for run in runs]
    if not all(done):
        return None
    return {
        axis: Ran([began[axis], *points_of(each.statuses)], axis.position())
        for axis, each in seen.items()
    }


def _judge(run: Run, seen: Watched) -> bool:
    """Report what is wrong with a run, and return whether it was right."""
    axis = run.axis
    speed = top_speed(points_of(seen.statuses))
    if seen.strayed is not None and speed > _FASTER * run.due:
        return axis.trial.must(
            False,
            f"{axis.text}: after {run.told}, it ran at {speed:.0f} counts/s to {seen.strayed.position} and "
            f"was stopped; with {run.too_fast.aspect} of {run.too_fast.subject}, its velocity should be "
            f"{run.due:.0f} counts/s",
            rule=rule_of_set(run.too_fast.subject),
            cause=run.too_fast,
            because=axis.spoilt,
            came=seen.strayed.heard.raw,
        )
    last = seen.strayed or seen.stopped
    if seen.unheard and last is None and seen.ends:
        axis.trial.inconclusive(
            f"{axis.text}: after {run.told}, its status did not come in time, so it was stopped after "
            f"{run.latest:.1f} s, before it could leave {axis.low}..{axis.high}"
        )
        return False
    if last is None:
        told = f"{run.told} from {run.start}, away from any limit"
        if seen.ends:
            axis.trial.must(
                False,
                f"{axis.text}: after {told}, it sent {seen.ends[0].name} without a stop "
                "command; it should run on",
                rule=run.rule,
                cause=run.cause,
                came=seen.ends[0].raw,
            )
        else:
            judge_end(axis, told, seen, STOPPED)
        return False
    way, gone = run.direction.name.lower(), run.gone(last)
    was = "down" if last.position > run.start else "up"
    before = f", and it went {was} when it last reported motion {way}" if gone < 0 else ""
    moved = axis.trial.must(
        gone > 0,
        f"{axis.text}: after {run.told}, it went from {run.start} to {last.position}; it should "
        f"have run {way}{before}",
        rule=run.rule_of_direction if gone < 0 else rule_of_command(run.told),
        cause=run.cause,
        because=(Cause(axis.status_name, "motion bits on the way"),),
        came=last.heard.raw,
    )
    if moved:
        gone = last.position - run.start
        judge_course(
            axis,
            run.told,
            seen.statuses,
            run.start,
            last.position + gone,
            direction=run.direction,
            jogging=run.jogging,
        )
        axis.learn(1 if gone > 0 else -1, run.direction)
    told = f"MOT_MOVE_STOP {run.mode.name.lower()} in {run.told}"
    if not judge_stopping(axis, told, run.start, seen, run.mode, endless=True):
        return False
    end = judge_end(axis, told, seen, STOPPED)
    if end is None or not judge_over(axis, told, end, seen):
        return False
    judge_rest(axis, told, end, seen)
    return moved

"""``move-velocity``: a motor runs in the commanded direction until it is stopped (page 48).

Before it starts a motor, the check makes sure that it can stop it in time: the motor runs so slowly that it
would need more than two seconds to the end of the range, and stops within a quarter of the rest. It is
stopped as soon as it has been seen to run. No page states in which direction positions rise, so it starts at
a position with room both up and down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status, change, present
from stagewire_conformance.device.checks.apt.motion.judgement import (
    judge_course,
    judge_end,
    judge_rest,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import make_room
from stagewire_conformance.device.checks.apt.motion.watch import Watched, is_outside, watch

_STOPPED: Final = "MOT_MOVE_STOPPED"
_RUNNING: Final = 0.25
"""The approximate duration of a run in seconds."""
_LATE: Final = 0.25
"""Seconds by which a stop may be late; the range leaves room for the motion in that time."""
_LEAST_ROOM: Final = 64
"""Counts of room required in a direction."""


def slow_down(axis: Axis, room: int) -> float:
    """Slow a motor down so that it needs at least two seconds for a number of counts.

    Return the velocity in counts/s that it then does not exceed.
    """
    now = axis.pace.velocity
    slow = min(now, room / 2, math.sqrt(room * axis.pace.acceleration / 2))
    told: int = present(axis, "MOT_SET_VELPARAMS")["max_velocity"]
    lower = max(1, int(told * slow / now))
    if lower < told:
        change(axis, "MOT_SET_VELPARAMS", at_most="max_velocity", max_velocity=lower)
    return slow


@dataclass
class _Run:
    """A run of a motor.

    :param velocity: the velocity that it does not exceed, in counts/s.
    """

    axis: Axis
    direction: MoveDirection
    velocity: float
    start: int = 0

    @property
    def told(self) -> str:
        """The command, for sentences."""
        return f"MOT_MOVE_VELOCITY {self.direction.name.lower()}"

    @property
    def stopping(self) -> float:
        """The counts that the motor may need to come to rest."""
        return self.velocity * (_LATE + self.velocity / self.axis.pace.acceleration / 2)

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
        ramp = self.velocity / self.axis.pace.acceleration
        if self.free < self.velocity * ramp / 2:
            return math.sqrt(2 * self.free / self.axis.pace.acceleration)
        return self.free / self.velocity + ramp / 2

    def gone(self, status: Status) -> int:
        """Return how far the motor has gone, as an absolute distance if its direction is unknown."""
        moved = status.position - self.start
        return moved * self.axis.way_of(self.direction) if self.axis.clockwise else abs(moved)


KIND = Kind(
    name="move-velocity",
    title="A motor runs until it is stopped",
    rules=(
        "velocity-move",
        "velocity-move-until-stop",
        "velocity-direction-values",
        "velocity-parameters",
        "stop-any-move",
        "stop-completed",
        "move-stopped-status",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_VELOCITY runs {motors} in the commanded direction until they are stopped",
    messages=(
        "MOT_MOVE_VELOCITY",
        "MOT_MOVE_STOP",
        _STOPPED,
        "MOT_SET_VELPARAMS",
        "MOT_REQ_VELPARAMS",
        "MOT_GET_VELPARAMS",
    ),
    does="slows all motors down with MOT_SET_VELPARAMS so that they stay within {range}, runs them "
    "together forward and in reverse for less than a second, stops them, and restores the "
    "velocity",
    settings=True,
    seconds=5.0,
)
def _run(axes: Sequence[Axis]) -> None:
    rooms = {axis: _room(axis) for axis in axes}
    if not make_room(rooms):
        return
    velocities = {axis: slow_down(axis, room) for axis, room in rooms.items()}
    for way in (MoveDirection.FORWARD, MoveDirection.REVERSE):
        if not _run_all([_Run(axis, way, velocity) for axis, velocity in velocities.items()]):
            return


def _room(axis: Axis) -> int:
    """Return the counts of room for a run both up and down; enough to keep the velocity, if possible."""
    half = axis.half(_LEAST_ROOM)
    velocity, acceleration = axis.pace.velocity, axis.pace.acceleration
    enough = 2 * velocity * max(1.0, velocity / acceleration)
    return max(_LEAST_ROOM, int(min(half, math.ceil(enough))))


def _run_all(runs: Sequence[_Run]) -> bool:
    """Run motors together, stop each, and judge the reaction; return whether all followed their commands."""
    by_axis = {run.axis: run for run in runs}
    for run in runs:
        run.start = run.axis.status().position
    if any(run.free < _LEAST_ROOM for run in runs):  # the first run ended where it should not have
        return False

    def enough(axis: Axis, status: Status) -> bool:
        run = by_axis[axis]
        gone = run.gone(status)
        return gone >= run.enough or -gone > run.stopping

    for run in runs:
        run.axis.send(m.MotMoveVelocity(run.axis.channel, run.direction))

    def strays(axis: Axis, status: Status) -> bool:
        run = by_axis[axis]
        too_far = run.enough + 2 * run.stopping + HELD
        return is_outside(axis, status) or abs(run.gone(status)) > too_far

    limits = {run.axis: 10 * _RUNNING + run.axis.pace.limit(int(run.stopping)) for run in runs}
    latest = {run.axis: run.latest for run in runs}
    seen = watch(list(by_axis), limits, stop=enough, strays=strays, deadlines=latest)
    done = [_judge(run, seen[run.axis]) for run in runs]
    return all(done)


def _judge(run: _Run, seen: Watched) -> bool:
    """Report what is wrong with a run, and return whether it was right."""
    axis = run.axis
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
                rule="velocity-move-until-stop",
                cause=Cause("MOT_MOVE_VELOCITY", EFFECT),
                came=seen.ends[0].raw,
            )
        else:
            judge_end(axis, told, seen, _STOPPED)
        return False
    way = run.direction.name.lower()
    moved = axis.trial.must(
        run.gone(last) > 0,
        f"{axis.text}: after {run.told}, it went from {run.start} to {last.position}; it should "
        f"have run {way}",
        rule="velocity-direction-values" if run.gone(last) < 0 else "velocity-move",
        cause=Cause("MOT_MOVE_VELOCITY", EFFECT),
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
        )
        axis.learn(1 if gone > 0 else -1, run.direction)
    told = f"MOT_MOVE_STOP in {run.told}"
    end = judge_end(axis, told, seen, _STOPPED)
    if end is not None:
        judge_rest(axis, told, end)
    return moved and end is not None

"""``move-velocity``: a motor runs in the commanded direction until it is stopped (page 48)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HELD, STOPPED, Axis
from stagewire_conformance.device.checks.apt.motion.course import (
    Point,
    plateau,
    top_speed,
    until_steady,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import make_room
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of
from stagewire_conformance.device.checks.apt.motion.runs import (
    WAYS,
    Ran,
    Run,
    judge_modes_of_runs,
    room_for,
    run_all,
    slow_down,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import Shuttle

_OFF: Final = 0.15
"""The relative difference of the constant speeds of a run and a move from which they differ."""
_ROUGHLY: Final = 0.4
"""That of their highest speeds, if the run was short."""
_LONG: Final = 0.2
"""The least duration in seconds of a constant speed."""
_SECONDS: Final = 0.3
"""Seconds that the move at least takes at the speed of the run."""


KIND = Kind(
    name="move-velocity",
    title="A motor runs until it is stopped",
    rules=(
        "velocity-move",
        "velocity-move-until-stop",
        "velocity-direction-values",
        "velocity-parameters",
        "stop-any-move",
        "stop-mode-values",
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
        STOPPED,
        *messages_of("VELPARAMS"),
        COMPLETED,
    ),
    does="slows all motors down with MOT_SET_VELPARAMS so that they stay within {range}, runs them "
    "together forward and in reverse for less than a second, stops them with a profile and immediately, "
    "moves them at the same velocity, and restores the velocity",
    settings=True,
    seconds=5.5,
)
def _run(axes: Sequence[Axis]) -> None:
    rooms = {axis: room_for(axis, axis.pace) for axis in axes}
    if not make_room(rooms):
        return
    velocities = {
        axis: (slow_down(axis, room), axis.pace.fastest.acceleration)
        for axis, room in rooms.items()
    }
    courses: dict[Axis, list[Point]] = {}
    done: list[tuple[Run, Ran]] = []
    for way, mode in WAYS:
        runs = [
            Run(axis, way, m.MotMoveVelocity(axis.channel, way), *velocity, mode=mode)
            for axis, velocity in velocities.items()
        ]
        found = run_all(runs, alone=not done)
        if found is None:
            return
        done += [(run, found[run.axis]) for run in runs]
        courses |= {axis: ran.points for axis, ran in found.items() if len(ran.points) > 1}
    judge_modes_of_runs(done)
    _compare(courses)


def _compare(runs: Mapping[Axis, list[Point]]) -> None:
    """Compare the speed of each run with that of a move with the same parameters.

    The move is so long that it reaches the speed of the run if its velocity is not limited further.
    """
    ways, begins = {}, {}
    for axis, points in runs.items():
        here = axis.position()
        enough = max(4 * until_steady(points), _SECONDS * top_speed(points))
        way = axis.wider(here)
        inside = axis.low <= here <= axis.high  # otherwise, its counter is wrong
        if inside and axis.room(here, way) >= enough > HELD:
            begins[axis], ways[axis] = here, way * int(enough)
    shuttle = Shuttle(ways, begins)
    for axis, speed in shuttle.speeds(list(ways)).items():
        points, move = runs[axis], shuttle.courses[axis][0]
        fast = plateau(points)
        # An average over a longer time is more precise, if the move also had a constant speed.
        is_long = bool(fast) and fast[-1].time - fast[0].time >= _LONG
        if is_long and move.steady >= (1 - _OFF) * speed:
            run, speed, off = top_speed([fast[0], fast[-1]]), move.steady, _OFF
        else:
            run, off = top_speed(points), _ROUGHLY
        gone = abs(points[-1].position - points[0].position)
        slow = run < (1 - off) * speed and gone > move.ramp
        axis.trial.must(
            run <= (1 + off) * speed and not slow,
            f"{axis.text}: with the same velocity parameters, MOT_MOVE_VELOCITY reached {run:.0f} "
            f"counts/s, and MOT_MOVE_ABSOLUTE {speed:.0f} counts/s; both should obey the maximum velocity",
            rule="velocity-parameters",
            cause=Cause("MOT_MOVE_VELOCITY", "speed"),
        )

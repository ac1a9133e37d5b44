"""``move-velocity``: a motor runs in the commanded direction until it is stopped (page 48)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HELD, STOPPED, Axis
from stagewire_conformance.device.checks.apt.motion.course import (
    Point,
    top_speed,
    until_steady,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import make_room
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of
from stagewire_conformance.device.checks.apt.motion.runs import (
    Run,
    room_for,
    run_all,
    slow_down,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import Shuttle

_FASTER: Final = 1.4
"""The ratio of the speed of a run to that of a move from which the run is too fast."""
_SLOWER: Final = 0.6
"""The same ratio below which a run is too slow that was long enough to reach the speed."""
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
    "together forward and in reverse for less than a second, stops them, moves them at the same "
    "velocity, and restores the velocity",
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
    for way in (MoveDirection.FORWARD, MoveDirection.REVERSE):
        runs = [
            Run(axis, way, m.MotMoveVelocity(axis.channel, way), *velocity)
            for axis, velocity in velocities.items()
        ]
        found = run_all(runs)
        if found is None:
            return
        courses |= {axis: course for axis, course in found.items() if len(course) > 1}
    _compare(courses)


def _compare(runs: Mapping[Axis, list[Point]]) -> None:
    """Compare the speed of each run with that of a move with the same parameters.

    The move is so long that it reaches the speed of the run if its velocity is not limited further.
    """
    ways, begins = {}, {}
    for axis, points in runs.items():
        here = axis.position()
        enough = max(2.5 * until_steady(points), _SECONDS * top_speed(points))
        way = axis.wider(here)
        inside = axis.low <= here <= axis.high  # otherwise, its counter is wrong
        if inside and axis.room(here, way) >= enough > HELD:
            begins[axis], ways[axis] = here, way * int(enough)
    shuttle = Shuttle(ways, begins)
    for axis, speed in shuttle.speeds(list(ways)).items():
        run, gone = top_speed(runs[axis]), abs(runs[axis][-1].position - runs[axis][0].position)
        slow = run < _SLOWER * speed and gone > shuttle.courses[axis][0].ramp
        axis.trial.must(
            run <= _FASTER * speed and not slow,
            f"{axis.text}: with the same velocity parameters, MOT_MOVE_VELOCITY reached {run:.0f} "
            f"counts/s, and MOT_MOVE_ABSOLUTE {speed:.0f} counts/s; both should obey the maximum velocity",
            rule="velocity-parameters",
            cause=Cause("MOT_MOVE_VELOCITY", "speed"),
        )

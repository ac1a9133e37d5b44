"""``move-jog``: jogs by a step, and jogs that only a stop ends (pages 32 and 47).

No page states in which direction positions rise, so each motor first goes to a position with room both up and
down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, MoveDirection
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, STOPPED, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import jog, make_room, move
from stagewire_conformance.device.checks.apt.motion.pace import Pace, jog_pace_of
from stagewire_conformance.device.checks.apt.motion.parameters import (
    change,
    jog_single_steps,
    messages_of,
)
from stagewire_conformance.device.checks.apt.motion.runs import (
    WAYS,
    Ran,
    Run,
    judge_modes_of_runs,
    room_for,
    run_all,
    slow_down,
)

_SECONDS: Final = 0.3
"""The approximate duration of a step in seconds."""
_LESS: Final = 0.75
"""The ratio of the steps of successive motors."""
_STEPS: Final = 8
"""The number of steps that a continuous jog covers, so that it is certainly not a single step."""

_FAR: Final = 0x1_0800
"""Counts of a step that needs more than 16 bits."""
_SECONDS_FAR: Final = 3.0
"""The maximum duration of such a step in seconds, approximately."""

_PARAMETERS: Final = messages_of("JOGPARAMS")

JOGS: Final = Cause("MOT_MOVE_JOG", EFFECT)
"""The cause that jogs do not go where they should. Later checks do not jog then."""


KIND = Kind(
    name="move-jog",
    title="A jog moves by one step, or until it is stopped, in the commanded direction",
    rules=(
        "jog-move",
        "jog-direction-values",
        "jog-move-completed",
        "jog-single-step",
        "jog-continuous",
        "stop-mode-values",
        "move-completed-status",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_JOG moves {motors} by one step, and each reports the end once",
    messages=("MOT_MOVE_JOG", *_PARAMETERS, COMPLETED),
    does="sets small single steps with MOT_SET_JOGPARAMS, jogs all motors together forward and in "
    "reverse within {range}, and restores the parameters",
    settings=True,
    seconds=2.9,
)
def _jog_steps(axes: Sequence[Axis]) -> None:
    paces = _paces(axes)
    steps = {
        axis: axis.step(_SECONDS * _LESS**index, paces[axis]) for index, axis in enumerate(axes)
    }
    if not make_room(steps):
        return
    jog_single_steps(steps)
    for way in (MoveDirection.FORWARD, MoveDirection.REVERSE):
        if not move([jog(axis, way, step, paces[axis]) for axis, step in steps.items()]):
            return


@motor_check(
    KIND,
    "In continuous mode, MOT_MOVE_JOG runs {motors} until they are stopped",
    messages=("MOT_MOVE_JOG", *_PARAMETERS, "MOT_MOVE_STOP", STOPPED),
    does="sets the continuous mode, a small step and a low velocity with MOT_SET_JOGPARAMS, jogs all "
    "motors together forward and in reverse within {range} for less than a second, stops them, and "
    "restores the parameters",
    settings=True,
    seconds=4.8,
    name="continuous",
)
def _jog_continuously(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(JOGS)
    paces = _paces(axes)
    rooms = {axis: room_for(axis, paces[axis]) for axis in axes}
    if not make_room(rooms):
        return
    velocities, steps = {}, {}
    for axis, room in rooms.items():
        pace = paces[axis].fastest
        velocities[axis] = slow_down(axis, room, pace, "MOT_SET_JOGPARAMS", "jog_max_velocity")
        steps[axis] = max(1, int(velocities[axis] * _SECONDS / _STEPS))
        change(
            axis,
            "MOT_SET_JOGPARAMS",
            jog_mode=int(JogMode.CONTINUOUS),
            jog_step_size=steps[axis],
        )
    done: list[tuple[Run, Ran]] = []
    for way, mode in WAYS:
        runs = [
            Run(
                axis,
                way,
                m.MotMoveJog(axis.channel, way),
                velocity,
                paces[axis].fastest.acceleration,
                jogging=True,
                pace=paces[axis],
                telling=2 * steps[axis],
                mode=mode,
            )
            for axis, velocity in velocities.items()
        ]
        found = run_all(runs)
        if found is None:
            return
        done += [(run, found[run.axis]) for run in runs]
    judge_modes_of_runs(done)


@motor_check(
    KIND,
    "MOT_MOVE_JOG moves {motors} by a step of more than 16 bits",
    messages=("MOT_MOVE_JOG", "MOT_MOVE_ABSOLUTE", *_PARAMETERS, COMPLETED),
    does=f"sets a single step of {_FAR} counts with MOT_SET_JOGPARAMS, jogs all motors together once "
    "forward within {range}, and restores the parameters",
    settings=True,
    seconds=3.0,
    name="far",
)
def _jog_far(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(JOGS, Cause("MOT_SET_JOGPARAMS", "jog_max_velocity"))
    paces = _paces(axes)
    reach = {axis: axis.step(_SECONDS_FAR, paces[axis].as_measured()) for axis in axes}
    steps = {axis: _FAR for axis in axes if reach[axis] >= _FAR}
    for axis in reach.keys() - steps.keys():
        axis.trial.info(
            f"{axis.text}: a jog by {_FAR} counts was left out: it has room, and {_SECONDS_FAR:g} s, for "
            f"{reach[axis]} counts"
        )
    if not steps or not make_room(steps):
        return
    jog_single_steps(steps)
    move([jog(axis, MoveDirection.FORWARD, step, paces[axis]) for axis, step in steps.items()])


def _paces(axes: Sequence[Axis]) -> dict[Axis, Pace]:
    """Return the paces of jogs."""
    return {axis: jog_pace_of(axis.trial, axis.place, axis.channel) for axis in axes}

"""``move-jog``: one jog is one step of the size that is set, forward and in reverse (pages 32 and 47).

No page says in which direction positions rise, so each motor first goes to where it has room up and down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, MoveDirection
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, change
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import COMPLETED, jog, make_room, move
from stagewire_conformance.device.checks.apt.motion.pace import Pace, jog_pace_of
from stagewire_conformance.device.checks.apt.motion.rules import MOTION_BITS

if TYPE_CHECKING:
    pass


_SECONDS: Final = 0.3
"""About how long a step takes."""
_LESS: Final = 0.75
"""The steps of each motor are smaller than those of the one before it."""


KIND = Kind(
    name="move-jog",
    title="A jog is one step in the direction that is named, and its end is told once",
    rules=(
        "jog-move",
        "jog-direction-values",
        "jog-move-completed",
        "jog-single-step",
        "move-completed-status",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_JOG moves {} by one step, and the end is told once",
    messages=(
        "MOT_MOVE_JOG",
        "MOT_SET_JOGPARAMS",
        "MOT_REQ_JOGPARAMS",
        "MOT_GET_JOGPARAMS",
        COMPLETED,
    ),
    does="sets single steps of a small size with MOT_SET_JOGPARAMS, jogs all motors at once forward and "
    "in reverse within {}, and puts the parameters back",
    settings=True,
)
def _run(axes: Sequence[Axis]) -> None:
    steps: dict[Axis, int] = {}
    paces: dict[Axis, Pace] = {}
    for index, axis in enumerate(axes):
        told = axis.ask(m.MotReqJogParams(axis.channel)).message
        paces[axis] = jog_pace_of(axis.place, axis.channel, told)
        steps[axis] = axis.step(_SECONDS * _LESS**index, paces[axis])
    if not make_room(steps):
        return
    for axis, step in steps.items():
        mode = int(JogMode.SINGLE_STEP)
        change(axis, "MOT_SET_JOGPARAMS", jog_mode=mode, jog_step_size=step)
    for way in (MoveDirection.FORWARD, MoveDirection.REVERSE):
        if not move([jog(axis, way, step, paces[axis]) for axis, step in steps.items()]):
            return

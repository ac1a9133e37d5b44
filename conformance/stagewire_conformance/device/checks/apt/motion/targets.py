"""Moves to a target: to a position, by a distance, to a stored target, by one jog, and of one motor alone.

- ``move-absolute``, ``move-relative``, ``move-stored``: to a target and back (pages 42 to 46).
- ``move-jog``: one jog is one step of the set size, forward and in reverse (pages 32 and 47). No page states
  in which direction positions rise, so each motor first goes to a position with room both up and down.
- ``move-alone``: of several motors, only the addressed one moves and reports it (pages 9 and 17). Bays differ
  only by the address in their messages, channels of a module only by the channel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, MoveDirection
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import JITTER, Axis, change
from stagewire_conformance.device.checks.apt.motion.motor_check import (
    APART,
    COMPLETION,
    MOTION_BITS,
    Moving,
    motor_check,
)
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    Move,
    absolute,
    distances,
    jog,
    make_room,
    move,
    relative,
)
from stagewire_conformance.device.checks.apt.motion.pace import Pace, jog_pace_of

_SECONDS: Final = 0.3
"""The approximate duration of a move in seconds."""


ABSOLUTE = Kind(
    name="move-absolute",
    title="An absolute move ends at its target, and its end is reported once",
    rules=(
        "absolute-move",
        "absolute-move-long",
        "absolute-move-completed",
        *COMPLETION,
        *APART,
    ),
)

RELATIVE = Kind(
    name="move-relative",
    title="A relative move covers its distance, and its end is reported once",
    rules=(
        "relative-move",
        "relative-move-long",
        "relative-move-completed",
        *COMPLETION,
        *APART,
    ),
)


@motor_check(
    ABSOLUTE,
    "MOT_MOVE_ABSOLUTE moves {motors} to a position, and each reports the end once",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together to positions within {range}, and back",
)
def _absolute(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    if move([absolute(axis, axis.start + way) for axis, way in ways.items()]):
        move([absolute(axis, axis.start) for axis in axes])


@motor_check(
    RELATIVE,
    "MOT_MOVE_RELATIVE moves {motors} by a distance, and each reports the end once",
    messages=("MOT_MOVE_RELATIVE", COMPLETED),
    does="moves all motors together by distances within {range}, and back",
)
def _relative(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    if move([relative(axis, way) for axis, way in ways.items()]):
        move([relative(axis, -way) for axis, way in ways.items()])


STORED = Kind(
    name="move-stored",
    title="A move command without data uses the stored target",
    rules=(
        "absolute-position-stored",
        "absolute-move-short",
        "relative-distance-stored",
        "relative-move-short",
        *COMPLETION,
    ),
)


def _stored_check(message: str, parameter: str) -> Callable[[Moving], Moving]:
    setting, *telling = (f"MOT_{role}_{parameter}" for role in ("SET", "REQ", "GET"))
    return motor_check(
        STORED,
        f"{message} without data moves {{motors}} to the target stored with {setting}",
        messages=(message, setting, *telling, COMPLETED),
        does=f"stores targets with {setting}, moves all motors together to them within "
        f"{{range}}, and back",
        settings=True,
        name=message,
    )


@_stored_check("MOT_MOVE_ABSOLUTE", "MOVEABSPARAMS")
def _stored_absolute(axes: Sequence[Axis]) -> None:
    moves = []
    for axis, way in distances(axes, _SECONDS).items():
        target = axis.start + way
        change(axis, "MOT_SET_MOVEABSPARAMS", absolute_position=target)
        told = f"MOT_MOVE_ABSOLUTE without a position, with {target} stored"
        moves.append(Move(axis, m.MotMoveAbsoluteHeader(axis.channel), target, told))
    move(moves)


@_stored_check("MOT_MOVE_RELATIVE", "MOVERELPARAMS")
def _stored_relative(axes: Sequence[Axis]) -> None:
    moves = []
    for axis, way in distances(axes, _SECONDS).items():
        change(axis, "MOT_SET_MOVERELPARAMS", relative_distance=way)
        told = f"MOT_MOVE_RELATIVE without a distance, with {way} stored"
        moves.append(Move(axis, m.MotMoveRelativeHeader(axis.channel), axis.start + way, told))
    move(moves)


_SECONDS_OF_JOG: Final = 0.3
"""The approximate duration of a step in seconds."""
_LESS: Final = 0.75
"""The ratio of the steps of successive motors."""


JOG = Kind(
    name="move-jog",
    title="A jog moves one step in the commanded direction, and its end is reported once",
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
    JOG,
    "MOT_MOVE_JOG moves {motors} by one step, and each reports the end once",
    messages=(
        "MOT_MOVE_JOG",
        "MOT_SET_JOGPARAMS",
        "MOT_REQ_JOGPARAMS",
        "MOT_GET_JOGPARAMS",
        COMPLETED,
    ),
    does="sets small single steps with MOT_SET_JOGPARAMS, jogs all motors together forward and in "
    "reverse within {range}, and restores the parameters",
    settings=True,
    seconds=2.6,
)
def _jog_steps(axes: Sequence[Axis]) -> None:
    steps: dict[Axis, int] = {}
    paces: dict[Axis, Pace] = {}
    for index, axis in enumerate(axes):
        told = axis.ask(m.MotReqJogParams(axis.channel)).message
        paces[axis] = jog_pace_of(axis.place, axis.channel, told)
        steps[axis] = axis.step(_SECONDS_OF_JOG * _LESS**index, paces[axis])
    if not make_room(steps):
        return
    for axis, step in steps.items():
        mode = int(JogMode.SINGLE_STEP)
        change(axis, "MOT_SET_JOGPARAMS", jog_mode=mode, jog_step_size=step)
    for way in (MoveDirection.FORWARD, MoveDirection.REVERSE):
        if not move([jog(axis, way, step, paces[axis]) for axis, step in steps.items()]):
            return


_SECONDS_ALONE: Final = 0.25


ALONE = Kind(
    name="move-alone",
    title="Of several motors, only the addressed one moves",
    rules=("absolute-move", *APART),
)


@motor_check(
    ALONE,
    "Of {motors}, only the addressed motor moves, and only it reports a move",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves one motor after the other within {range}, and back",
    at_least=2,
)
def _one_alone(axes: Sequence[Axis]) -> None:
    for axis, way in distances(axes, _SECONDS_ALONE).items():
        target = axis.start + way
        others = [other for other in axes if other is not axis]
        stood = {other: other.status().position for other in others}
        arrived = move([absolute(axis, target)])
        for other in others:
            status = other.status()
            axis.trial.must(
                abs(status.position - stood[other])
                <= 2 * JITTER,  # it may have oscillated from one end to the other
                f"{axis.text} alone was commanded to move, but {other.text} went from "
                f"{stood[other]} to {status.position}; it should not move",
                rule="slot-addressed-by-destination"
                if axis.place != other.place
                else "module-channels",
                came=status.heard.raw,
            )
        if not arrived:
            return

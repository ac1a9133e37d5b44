"""``move-absolute``, ``move-relative``, ``move-stored``: to a target and back (pages 42 to 46)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, change
from stagewire_conformance.device.checks.apt.motion.motor_check import Moving, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    Move,
    absolute,
    distances,
    move,
    relative,
)
from stagewire_conformance.device.checks.apt.motion.rules import APART, COMPLETION

if TYPE_CHECKING:
    pass


_SECONDS: Final = 0.3
"""About how long a move takes."""


ABSOLUTE = Kind(
    name="move-absolute",
    title="An absolute move ends where it was told to, and says so once",
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
    title="A relative move goes as far as it was told to, and says so once",
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
    "MOT_MOVE_ABSOLUTE moves {} to a position, and the end is told once",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors at once to positions within {}, and back",
)
def _absolute(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    if move([absolute(axis, axis.start + way) for axis, way in ways.items()]):
        move([absolute(axis, axis.start) for axis in axes])


@motor_check(
    RELATIVE,
    "MOT_MOVE_RELATIVE moves {} by a distance, and the end is told once",
    messages=("MOT_MOVE_RELATIVE", COMPLETED),
    does="moves all motors at once by distances within {}, and back",
)
def _relative(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    if move([relative(axis, way) for axis, way in ways.items()]):
        move([relative(axis, -way) for axis, way in ways.items()])


STORED = Kind(
    name="move-stored",
    title="A move without data takes what was stored for it",
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
        f"{message} without data moves {{}} by what {setting} stored",
        messages=(message, setting, *telling, COMPLETED),
        does=f"stores targets with {setting}, moves all motors at once to them within {{}}, and back",
        settings=True,
        name=message,
    )


@_stored_check("MOT_MOVE_ABSOLUTE", "MOVEABSPARAMS")
def _stored_absolute(axes: Sequence[Axis]) -> None:
    moves = []
    for axis, way in distances(axes, _SECONDS).items():
        target = axis.start + way
        change(axis, "MOT_SET_MOVEABSPARAMS", absolute_position=target)
        told = f"MOT_MOVE_ABSOLUTE without a position, {target} being stored"
        moves.append(Move(axis, m.MotMoveAbsoluteHeader(axis.channel), target, told))
    move(moves)


@_stored_check("MOT_MOVE_RELATIVE", "MOVERELPARAMS")
def _stored_relative(axes: Sequence[Axis]) -> None:
    moves = []
    for axis, way in distances(axes, _SECONDS).items():
        change(axis, "MOT_SET_MOVERELPARAMS", relative_distance=way)
        told = f"MOT_MOVE_RELATIVE without a distance, {way} being stored"
        moves.append(Move(axis, m.MotMoveRelativeHeader(axis.channel), axis.start + way, told))
    move(moves)

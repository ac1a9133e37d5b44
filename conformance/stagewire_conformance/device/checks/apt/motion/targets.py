"""Moves to a target: to a position, by a distance, and to a stored target.

- ``move-absolute``, ``move-relative``, ``move-stored``: to a target and back (pages 42 to 46). A move to the
  present position also ends. After MOT_SET_POSCOUNTER, targets count from the new zero (page 28).
- ``move-far``: to a position that needs more than 16 bits, if the range and the time allow it, and back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import (
    APART,
    COMPLETION,
    Moving,
    motor_check,
)
from stagewire_conformance.device.checks.apt.motion.moves import (
    Move,
    absolute,
    distances,
    long_enough,
    move,
    relative,
)
from stagewire_conformance.device.checks.apt.motion.parameters import (
    change,
    messages_of,
    shift_counter,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting

_SECONDS: Final = 0.3
"""The approximate duration of a move in seconds."""
_LONGER: Final = 0.5
"""That of the moves whose accuracy matters most."""
_LITTLE: Final = 64
"""Counts of a move that is much shorter than the others."""


ABSOLUTE = Kind(
    name="move-absolute",
    title="An absolute move ends at its target, and its end is reported once",
    rules=(
        "absolute-move",
        "absolute-move-long",
        "absolute-move-completed",
        "position-counter-set",
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
    does="moves all motors together to positions within {range}, and back, and then to where they are",
    seconds=1.9,
)
def _absolute(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _LONGER)
    out = [absolute(axis, axis.start + way) for axis, way in ways.items()]
    if move(out) and move([absolute(axis, axis.start) for axis in axes]):
        move([absolute(axis, axis.position(), ", where it is") for axis in axes])


@motor_check(
    ABSOLUTE,
    "After MOT_SET_POSCOUNTER, MOT_MOVE_ABSOLUTE moves {motors} to positions that count from the new zero",
    messages=("MOT_MOVE_ABSOLUTE", *messages_of("POSCOUNTER"), COMPLETED),
    does="sets the position counters of all motors to other values, moves them together within {range}, "
    "restores the counters, and moves them back",
    settings=True,
    name="counter",
    only="MOT_SET_LIMSWITCHPARAMS",  # page 28 advises against it for brushless controllers
)
def _from_another_zero(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(Cause("MOT_SET_POSCOUNTER", EFFECT))
    # A motor that still counts from its old zero goes twice as far, and remains within the range.
    ways = {axis: way // 2 for axis, way in distances(axes, 2 * _SECONDS).items()}
    ways = long_enough(ways, "a shift of {} counts is too short to be observed")
    moves = []
    for axis, way in ways.items():
        shift_counter(axis, way)
        moves.append(absolute(axis, axis.start + way, f" after the counter was raised by {way}"))
    move(moves)


@motor_check(
    RELATIVE,
    "MOT_MOVE_RELATIVE moves {motors} by a distance, and each reports the end once",
    messages=("MOT_MOVE_RELATIVE", COMPLETED),
    does="moves all motors together by distances within {range}, and back",
)
def _relative(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    if move([relative(axis, way) for axis, way in ways.items()]):
        little = {
            axis: min(_LITTLE, abs(way)) * (1 if way < 0 else -1) for axis, way in ways.items()
        }
        if move([relative(axis, way) for axis, way in little.items()]):
            move([relative(axis, -way - little[axis]) for axis, way in ways.items()])


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


def _stored_check(message: str, parameters: str) -> Callable[[Moving], Moving]:
    setting, *others = messages_of(parameters)
    return motor_check(
        STORED,
        f"{message} without data moves {{motors}} to the target stored with {setting}",
        messages=(message, setting, *others, COMPLETED),
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


_ALIKE: Final = 1.3
"""The ratio of the speeds of two such moves up to which they are the same."""
_SECONDS_FAR: Final = 3.0
"""The maximum duration of a long move in seconds, approximately."""
_FAR: Final = 0x1_1000
"""Counts of a long move. From near 0, its target needs more than 16 bits; the lower 16 bits are near 0."""


FAR = Kind(
    name="move-far",
    title="A move covers a long distance, and ends exactly at its target",
    rules=("absolute-move-long", "relative-move-long", "velocity-parameters", *COMPLETION),
)


@motor_check(
    FAR,
    "MOT_MOVE_ABSOLUTE moves {motors} far away, and MOT_MOVE_RELATIVE back",
    messages=("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE", COMPLETED),
    does=f"moves all motors together by up to {_FAR} counts within {{range}}, and back",
    seconds=4.5,
    also=messages_of("VELPARAMS"),
)
def _far(axes: Sequence[Axis]) -> None:
    lasting = distances_lasting(axes, _SECONDS_FAR)
    ways = {axis: max(-_FAR, min(way, _FAR)) for axis, way in lasting.items()}
    out = [absolute(axis, axis.start + way) for axis, way in ways.items()]
    if move([replace(each, accurate=True) for each in out]):
        back = [relative(axis, -way) for axis, way in ways.items()]
        if move([replace(each, accurate=True) for each in back]):
            for axis in axes:
                _judge_directions(axis)


def _judge_directions(axis: Axis) -> None:
    """Report a move back over the same way that was faster or slower than the move before."""
    out, back = axis.speeds[-2:]
    axis.trial.must(
        max(out, back) <= _ALIKE * min(out, back),
        f"{axis.text}: over the same way, MOT_MOVE_ABSOLUTE reached {out:.0f} counts/s, and "
        f"MOT_MOVE_RELATIVE back {back:.0f} counts/s; the maximum velocity is the same in both directions",
        rule="velocity-parameters",
        cause=Cause("MOT_SET_VELPARAMS", "max_velocity"),
    )

"""``in-motion``: a moving motor answers and obeys (pages 28 to 30, 45 and 81).

Its replies agree with each other: status, status bits, position counter and encoder counter. It takes a SET,
which does not end the move, and a second move, which replaces the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, ENDS, Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of, placed_set
from stagewire_conformance.device.checks.apt.motion.replies_together import (
    EncoderReadings,
    judge_bits_alone,
    judge_counter,
    judge_fresh_bits,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting
from stagewire_conformance.device.checks.apt.motion.watch import watch

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS: Final = 0.5
"""The approximate duration of the move in seconds."""
_BEGUN: Final = 0.15
"""Seconds after which a motor that has been commanded to move reports motion."""
_VELPARAMS: Final = "MOT_SET_VELPARAMS"


KIND = Kind(
    name="in-motion",
    title="A moving motor answers and obeys",
    rules=(
        "status-bits-same",
        "position-counter-absolute",
        "encoder-counter-after-homing",
        "status-position",
        "dc-status-position",
        "velocity-parameters",
        "absolute-move",
    ),
)


@motor_check(
    KIND,
    "The replies of {motors} agree with each other during a move, which a second move replaces",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range}, reads their counters and status bits meanwhile, moves "
    "them back, and commands them on that way to turn round",
    seconds=3.2,
    also=("MOT_REQ_ENCCOUNTER", "MOT_GET_ENCCOUNTER"),
)
def _agree(axes: Sequence[Axis]) -> None:
    ways = distances_lasting(axes, _SECONDS)
    right = dict.fromkeys(axes, True)
    looks = dict.fromkeys(axes, 0)
    encoders = {axis: EncoderReadings(axis) for axis in axes}

    def compare(axis: Axis, status: Status) -> bool:
        """Compare the replies of a moving motor, until they differ: its counters in turn.

        More requests could make a controller fall silent before the next keep-alive message (page 80).
        """
        looks[axis] += status.moving
        if status.moving and looks[axis] % 2:
            encoders[axis].read()
        elif right[axis] and status.moving:
            when = f"on its way after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}"
            ends = axis.start, axis.start + ways[axis]
            right[axis] = judge_bits_alone(axis, when) and judge_counter(
                axis, when, axis.status(), ends
            )
        return False

    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    axes[0].pause(_BEGUN)
    for axis in axes:
        judge_fresh_bits(axis, f"{_BEGUN:g} s after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}")
    seen = watch(axes, limits, done=compare)
    for axis in axes:
        if not seen[axis].ends:
            axis.halt()
        encoders[axis].judge(f"on its way after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}")
    if all(right.values()) and all(seen[axis].ends for axis in axes):
        _turn_round(ways)


def _turn_round(ways: Mapping[Axis, int]) -> None:
    """Command the motors back, and on their way to where they came from.

    No page states what a move during a move does, so a motor that does not obey the last command is
    NON-STRICT.
    """
    for axis in ways:
        axis.send(absolute(axis, axis.start).message)
    next(iter(ways)).pause(_BEGUN)
    turned = {axis: axis.position() for axis in ways}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    watch(list(ways), {axis: axis.pace.bound(way) for axis, way in ways.items()})
    for axis, way in ways.items():
        rest = axis.standing()  # the end of the first move may have been reported
        target = axis.start + way
        axis.trial.should(
            abs(rest.position - target) <= axis.tolerance(way),
            f"{axis.text}: on its way after MOT_MOVE_ABSOLUTE to {axis.start}, at {turned[axis]}, it received "
            f"MOT_MOVE_ABSOLUTE to {target}, but came to rest at {rest.position}; the last command should "
            "decide",
            rule="absolute-move",
            cause=Cause("MOT_MOVE_ABSOLUTE", "during a move"),
            because=axis.doubts,
            came=rest.heard.raw,
        )
    line = next(iter(ways)).trial.line
    line.heard[:] = [heard for heard in line.heard if heard.name not in ENDS]


@motor_check(
    KIND,
    "{motors} take MOT_SET_VELPARAMS during a move, and arrive",
    messages=("MOT_MOVE_ABSOLUTE", *messages_of("VELPARAMS"), COMPLETED),
    does="moves all motors together within {range}, lowers their velocity with MOT_SET_VELPARAMS on the way, "
    "moves them back, and restores the velocity",
    settings=True,
    seconds=1.6,
    name="settings",
)
def _take_settings(axes: Sequence[Axis]) -> None:
    ways = distances_lasting(axes, _SECONDS)
    sets = {axis: placed_set(axis, _VELPARAMS) for axis in axes}
    before = {axis: sets[axis].read(axis.trial) for axis in axes}
    told: dict[Axis, Incoming] = {}

    def lower(axis: Axis, status: Status) -> bool:
        """Lower the velocity of a moving motor once."""
        if axis not in told and status.moving and before[axis]["max_velocity"] > 1:
            velocity = before[axis]["max_velocity"] * 7 // 8
            sets[axis].write(axis.trial, {**before[axis], "max_velocity": velocity})
            told[axis] = sets[axis].ask(axis.trial)
        return False

    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        sets[axis].undo(axis.trial, before[axis])
        axis.send(absolute(axis, axis.start + way).message)
    seen = watch(axes, limits, done=lower)
    for axis, came in told.items():
        target, rest = axis.start + ways[axis], axis.standing()
        taken = axis.trial.must(
            sets[axis].values(came)["max_velocity"] < before[axis]["max_velocity"],
            f"{axis.text}: on its way after MOT_MOVE_ABSOLUTE to {target}, {_VELPARAMS} wrote a lower "
            f"max_velocity, but {came.name} still returned {before[axis]['max_velocity']}; a moving motor "
            "should take it",
            rule=rule_of_set(_VELPARAMS),
            cause=Cause(_VELPARAMS, "in motion"),
            came=came.raw,
        )
        ends = [end.name for end in seen[axis].ends]
        axis.trial.must(
            not taken
            or (ends[:1] == [COMPLETED] and abs(rest.position - target) <= axis.tolerance(ways[axis])),
            f"{axis.text}: {_VELPARAMS} was sent on its way after MOT_MOVE_ABSOLUTE to {target}; then it sent "
            f"{ends[0] if ends else 'no end message'} and came to rest at {rest.position}; a SET should not "
            "end the move",
            rule=rule_of_set(_VELPARAMS),
            cause=Cause(_VELPARAMS, "in motion"),
            because=axis.doubts,
            came=rest.heard.raw,
        )

"""``mid-move``: a moving motor obeys another command (pages 30, 45 and 46).

A second move replaces the first. A SET takes effect in its GET, and does not end the move. Moves on their own
have been checked before, so a motor that misses its target here misses it because of the second command.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of, placed_set
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting
from stagewire_conformance.device.checks.apt.motion.watch import drop_ends, watch

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS: Final = 0.5
"""The approximate duration of the move in seconds."""
_BEGUN: Final = 0.15
"""Seconds after which a motor that has been commanded to move is on its way."""
_VELPARAMS: Final = "MOT_SET_VELPARAMS"
_MOVES: Final = (Cause("MOT_MOVE_ABSOLUTE", EFFECT), Cause(COMPLETED, "early"))
"""The defects with which a move on its own does not end where it should."""


KIND = Kind(
    name="mid-move",
    title="A moving motor obeys another command",
    rules=("absolute-move", "velocity-parameters"),
)


@motor_check(
    KIND,
    "A second move replaces the first one of {motors}",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range}, and commands them to turn round on the way",
    seconds=1.2,
)
def _turn_round(axes: Sequence[Axis]) -> None:
    """Command the motors to move, and on their way to go back.

    No page states what a move during a move does, so a motor that does not obey the last command is
    NON-STRICT.
    """
    axes[0].trial.depends_on(*_MOVES)
    ways = distances_lasting(axes, _SECONDS)
    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    axes[0].pause(_BEGUN)
    turned = {axis: axis.position() for axis in axes}
    for axis in axes:
        axis.send(absolute(axis, axis.start).message)
    watch(axes, limits)
    for axis, way in ways.items():
        rest = axis.standing()  # the end of the first move may have been reported
        axis.trial.should(
            abs(rest.position - axis.start) <= axis.tolerance(way),
            f"{axis.text}: on its way after MOT_MOVE_ABSOLUTE to {axis.start + way}, at {turned[axis]}, it "
            f"received MOT_MOVE_ABSOLUTE to {axis.start}, but came to rest at {rest.position}; the last "
            "command should decide",
            rule="absolute-move",
            cause=Cause("MOT_MOVE_ABSOLUTE", "during a move"),
            because=axis.doubts,
            came=rest.heard.raw,
        )
    drop_ends(axes[0])


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
    axes[0].trial.depends_on(*_MOVES)
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
            because=sets[axis].reported(axis.trial),
            came=came.raw,
        )
        ends = [end.name for end in seen[axis].ends]
        axis.trial.must(
            not taken or abs(rest.position - target) <= axis.tolerance(ways[axis]),
            f"{axis.text}: {_VELPARAMS} was sent on its way after MOT_MOVE_ABSOLUTE to {target}; then it "
            f"sent {ends[0] if ends else 'no end message'} and came to rest at {rest.position}; a SET should "
            "not end the move",
            rule=rule_of_set(_VELPARAMS),
            cause=Cause(_VELPARAMS, "in motion"),
            because=axis.doubts,
            came=rest.heard.raw,
        )

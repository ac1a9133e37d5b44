"""``disabled``: a motor that is disabled on its way stops, and carries out no command to move (page 17)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.enable_state import ENABLING, put_back
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting

_SECONDS: Final = 0.8
"""The approximate duration of the move in seconds."""
_BEFORE: Final = 0.25
"""Seconds after which a motor is disabled at the latest."""
_LOOK: Final = 0.02
"""Seconds between two looks at a motor that is going to be disabled."""


_WATCHED: Final = 0.2
"""Seconds in which a disabled motor must not begin to move."""


KIND = Kind(
    name="disabled",
    title="A motor that is disabled on its way stops, and does not move again",
    rules=("channel-enable",),
)


@motor_check(
    KIND,
    "Disabling a channel stops {motors}, which then does not move",
    messages=(
        "MOT_MOVE_ABSOLUTE",
        "MOD_SET_CHANENABLESTATE",
        "MOD_REQ_CHANENABLESTATE",
        "MOD_GET_CHANENABLESTATE",
    ),
    does="moves all motors together within {range}, disables their channels on the way, commands them "
    "to move back while they are disabled, enables them, and moves them back",
    seconds=3.0,
)
def _stops(axes: Sequence[Axis]) -> None:
    ways = distances_lasting(axes, _SECONDS)
    for axis in axes:
        what = f"enable state of {axis.text}"
        axis.trial.undo(
            what,
            partial(put_back, axis.trial, axis.place, axis.channel, EnableState.ENABLE),
            because=lambda: ENABLING,
        )
    for axis in axes:
        axis.send(absolute(axis, axis.start + ways[axis]).message)
    _wait_for_a_fifth(ways)
    for axis in axes:
        axis.send(m.ModSetChanEnableState(axis.channel, EnableState.DISABLE))
    begun = {axis: axis.position() for axis in axes}
    stopped = {}
    for axis in axes:
        rest = axis.standing()
        target = axis.start + ways[axis]
        if abs(target - begun[axis]) <= abs(ways[axis]) // 4:
            axis.trial.inconclusive(f"{axis.text} had almost arrived when it was disabled")
            continue
        if axis.trial.should(
            abs(rest.position - target) > HELD,
            f"{axis.text}: MOD_SET_CHANENABLESTATE disabled it at {begun[axis]}, but it went on to its "
            f"target {target}; a disabled motor should not move",
            rule="channel-enable",
            because=ENABLING,
            came=rest.heard.raw,
        ):
            stopped[axis] = rest
    _command_back(stopped)
    axes[0].trial.line.listen(0)


def _command_back(stopped: Mapping[Axis, Status]) -> None:
    """Command disabled motors to move back, and report those that do."""
    for axis in stopped:
        axis.send(absolute(axis, axis.start).message)
    for axis, rest in stopped.items():
        axis.pause(_WATCHED)
        now = axis.status()
        moves = abs(now.position - rest.position) > HELD
        if moves:
            axis.halt()
        axis.trial.should(
            not moves,
            f"{axis.text}: MOD_SET_CHANENABLESTATE disabled it at {rest.position}, but after "
            f"MOT_MOVE_ABSOLUTE to {axis.start} it was at {now.position}; a disabled motor should not move",
            rule="channel-enable",
            because=ENABLING,
            came=now.heard.raw,
        )


def _wait_for_a_fifth(ways: Mapping[Axis, int]) -> None:
    """Wait until a motor has covered a fifth of its way: the time of a move may not be known."""
    line = next(iter(ways)).trial.line
    end = line.now + _BEFORE
    while line.now < end:
        if any(abs(axis.position() - axis.start) >= abs(way) / 5 for axis, way in ways.items()):
            return
        line.pause(_LOOK)

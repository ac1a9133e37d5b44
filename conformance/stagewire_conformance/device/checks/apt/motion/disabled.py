"""``disabled``: a motor that is disabled on its way stops, and carries out no command to move (page 17).

Of several motors, the first is disabled while the others move on, and then the others are, on their way back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.enable_state import CONFUSING, ENABLING, put_back
from stagewire_conformance.device.checks.apt.motion.apart import need_apart
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
_SHORT: Final = 4
"""A motor was stopped by mistake if more than a quarter of its way is left."""


_WATCHED: Final = 0.2
"""Seconds in which a disabled motor must not begin to move."""


KIND = Kind(
    name="disabled",
    title="A motor that is disabled on its way stops, and does not move again",
    rules=("channel-enable", "slot-addressed-by-destination", "module-channels"),
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
    does="moves all motors within {range}, disables their channels on the way, of several motors the "
    "first one before the others, commands them to move while they are disabled, enables them, and moves "
    "them back",
    seconds=3.2,
)
def _stops(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(CONFUSING)
    ways = distances_lasting(axes, _SECONDS)
    for axis in axes:
        what = f"enable state of {axis.text}"
        axis.trial.undo(
            what,
            partial(put_back, axis.trial, axis.place, axis.channel, EnableState.ENABLE),
            because=lambda: ENABLING,
        )
    first, *others = axes
    targets = {axis: axis.start + ways[axis] for axis in axes}
    for axis in axes:
        axis.send(absolute(axis, targets[axis]).message)
    begun = _disable([first], targets)
    for other in others:
        _need_arrived(first, other, targets[other])
    stopped = _rests(begun, targets, since_long=bool(others))
    if others:
        back = {axis: axis.start for axis in others}
        for axis in others:
            axis.send(absolute(axis, axis.start).message)
        stopped |= _rests(_disable(others, back), back)
    _command_back(stopped)
    first.trial.line.listen(0)


def _disable(axes: Sequence[Axis], targets: Mapping[Axis, int]) -> dict[Axis, int]:
    """Disable motors on their way; return where each was, unless it had almost arrived."""
    starts = {axis: axis.position() for axis in axes}
    ways = {axis: targets[axis] - starts[axis] for axis in axes}
    _wait_for_a_fifth(starts, ways)
    for axis in axes:
        axis.send(m.ModSetChanEnableState(axis.channel, EnableState.DISABLE))
    begun = {}
    for axis in axes:
        place = axis.position()
        if abs(targets[axis] - place) <= abs(ways[axis]) // 4:
            axis.trial.inconclusive(f"{axis.text} had almost arrived when it was disabled")
        else:
            begun[axis] = place
    return begun


def _rests(
    begun: Mapping[Axis, int], targets: Mapping[Axis, int], *, since_long: bool = False
) -> dict[Axis, Status]:
    """Report disabled motors that have moved on to their targets; return the statuses of the others.

    :param since_long: whether they certainly are at rest by now.
    """
    stopped = {}
    for axis, place in begun.items():
        rest, target = axis.status() if since_long else axis.standing(), targets[axis]
        if axis.trial.should(
            abs(rest.position - target) > HELD,
            f"{axis.text}: MOD_SET_CHANENABLESTATE disabled it at {place}, but it went on to its "
            f"target {target}; a disabled motor should not move",
            rule="channel-enable",
            because=ENABLING,
            came=rest.heard.raw,
        ):
            stopped[axis] = rest
    return stopped


def _need_arrived(disabled: Axis, other: Axis, target: int) -> None:
    """Report a motor that has stopped on its way because another one was disabled, and end the check."""
    rest = other.standing()
    way = abs(target - other.start)
    need_apart(
        abs(rest.position - target) <= max(HELD, way // _SHORT),
        disabled,
        other,
        f"MOD_SET_CHANENABLESTATE disabled {disabled.text}, but {other.text} also stopped, at "
        f"{rest.position} on its way from {other.start} to {target}; it should move on",
        rest.heard,
    )


def _command_back(stopped: Mapping[Axis, Status]) -> None:
    """Command disabled motors to move back, and report those that do."""
    for axis in stopped:
        axis.send(absolute(axis, axis.start).message)
    for axis in list(stopped)[:1]:
        axis.pause(_WATCHED)
    for axis, rest in stopped.items():
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


def _wait_for_a_fifth(starts: Mapping[Axis, int], ways: Mapping[Axis, int]) -> None:
    """Wait until a motor has covered a fifth of its way: the time of a move may not be known."""
    line = next(iter(ways)).trial.line
    end = line.now + _BEFORE
    while line.now < end:
        if any(abs(axis.position() - starts[axis]) >= abs(way) / 5 for axis, way in ways.items()):
            return
        line.pause(_LOOK)

"""``soft-limits``: a software limit stops a move (pages 39 and 40).

Each motor moves up to a target beyond a limit that is set half-way, and must not arrive. Page 39 gives the
limits in position steps, and also a factor that contradicts them (erratum apt-limswitch-soft-limit-factor).
With this factor, the same number is a limit nearer to 0. So the check only uses positions above 0, and does
not judge where a motor stops before its target.

No page states in which direction positions rise. If a motor passes the clockwise limit, the other one is
tried.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from stagewire_apt.enumerations import SoftwareLimitMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HELD, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute, beyond, move
from stagewire_conformance.device.checks.apt.motion.parameters import (
    change,
    messages_of,
    switch_backlash_off,
)
from stagewire_conformance.device.checks.apt.motion.watch import watch

_SETTING: Final = "MOT_SET_LIMSWITCHPARAMS"
_SECONDS: Final = 0.4
"""The approximate duration of the move to the target in seconds."""
_LEAST: Final = 8 * HELD
"""The least counts to the target."""
_FIELDS: Final = ("cw_soft_limit", "ccw_soft_limit")


KIND = Kind(
    name="soft-limits",
    title="A software limit stops a move before a target beyond it",
    rules=("soft-limit-modes", "limit-switch-parameters"),
)


@motor_check(
    KIND,
    "A move of {motors} ends at a software limit that is nearer than its target",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED, *messages_of("LIMSWITCHPARAMS")),
    does="sets a software limit within {range} for each motor, commands all motors together to move beyond "
    "it, still within the range, restores the limits, and moves the motors back",
    settings=True,
    seconds=1.8,
    only=_SETTING,
)
def _stops(axes: Sequence[Axis]) -> None:
    ways = {axis: way for axis in axes if (way := _way(axis))}
    lower = [axis for axis in ways if axis.room(axis.start, 1) < ways[axis]]
    if not ways or (
        lower and not move([absolute(axis, axis.start - ways[axis]) for axis in lower])
    ):
        return
    for upper, other in (_FIELDS, _FIELDS[::-1]):
        ways = _pass(ways, upper, other)
        if not ways or not move(
            [absolute(axis, axis.position() - way) for axis, way in ways.items()]
        ):
            return
    for axis in ways:
        axis.trial.must(
            False,
            f"{axis.text}: with a software limit on its way in {_SETTING}, which stops it immediately, "
            f"MOT_MOVE_ABSOLUTE over {ways[axis]} counts ended at its target; it should end at the limit",
            rule="soft-limit-modes",
            cause=Cause(_SETTING, EFFECT),
            because=axis.spoilt,
        )


def _way(axis: Axis) -> int:
    """Return the counts that a motor moves up, from a position above 0; 0 if it has no room."""
    switch_backlash_off(axis)
    way = max(_LEAST, axis.pace.distance(_SECONDS))
    room = max(axis.room(axis.start, 1), axis.start - max(0, axis.inner[0]))
    if room < _LEAST or axis.start < 0:
        axis.trial.inconclusive(
            f"{axis.text} is at {axis.start}; there, {axis.low}..{axis.high} has too little room for a "
            "software limit above 0"
        )
        return 0
    return min(way, room)


def _pass(ways: Mapping[Axis, int], upper: str, lower: str) -> dict[Axis, int]:
    """Move motors up, with a limit half-way, and return those that arrive.

    :param upper: the field that is used as the upper limit.
    :param lower: the other one.
    """
    starts = {axis: axis.position() for axis in ways}
    for axis, way in ways.items():
        values: dict[str, Any] = {
            upper: starts[axis] + way // 2,
            lower: max(0, starts[axis] - _LEAST),
            "software_limit_mode": int(SoftwareLimitMode.STOP_IMMEDIATE),
        }
        change(axis, _SETTING, at_most="", **values)
    bounds = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(absolute(axis, starts[axis] + way).message)
    watch(list(ways), bounds, strays=beyond(starts, ways))
    rests = {axis: axis.settled(axis.status()).position for axis in ways}
    next(iter(ways)).trial.line.listen(0)
    return {
        axis: way
        for axis, way in ways.items()
        if abs(rests[axis] - starts[axis] - way) <= axis.tolerance(way)
    }

"""``soft-limits``: a software limit stops a move (pages 39 and 40).

Each motor moves towards a target beyond a limit that is set half-way, and must not arrive. Page 39 gives the
limits in position steps, and also a factor that contradicts them (erratum apt-limswitch-soft-limit-factor).
With this factor, the same number is a limit nearer to 0. So the check uses only positions above 0, and does
not judge where a motor stops before its target. Before that, the status bits of a short move show which
direction is clockwise, because no page states in which direction positions rise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_apt.enumerations import MoveDirection, SoftwareLimitMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HELD, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute, beyond, move
from stagewire_conformance.device.checks.apt.motion.parameters import (
    change,
    messages_of,
    present,
    switch_backlash_off,
)
from stagewire_conformance.device.checks.apt.motion.watch import watch

_SETTING: Final = "MOT_SET_LIMSWITCHPARAMS"
_SECONDS: Final = 0.5
"""The approximate duration of the move to the target in seconds."""
_SHORT: Final = 0.15
"""The same seconds for the move that shows the direction."""
_LEAST: Final = 8 * HELD
"""The least counts to the target."""
_FIELDS: Final = {
    MoveDirection.FORWARD: ("cw_soft_limit", "ccw_soft_limit"),
    MoveDirection.REVERSE: ("ccw_soft_limit", "cw_soft_limit"),
}
"""Direction -> the limit in this direction, and the other one. Forward is clockwise (page 77)."""


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
    seconds=2.0,
    only=_SETTING,
)
def _stops(axes: Sequence[Axis]) -> None:
    shown = []
    for axis in axes:
        switch_backlash_off(axis)
        if axis.room(axis.start, 1) >= 2 * _LEAST and axis.start >= 0:
            way = min(axis.pace.distance(_SHORT) + HELD, axis.room(axis.start, 1) // 4)
            shown.append(absolute(axis, axis.start + way))
        else:
            axis.trial.inconclusive(
                f"{axis.text} is at {axis.start}; there, {axis.low}..{axis.high} has too little room for a "
                "software limit above 0"
            )
    if not shown or not move(shown):
        return
    targets = {each.axis: target for each in shown if (target := _limit(each.axis)) is not None}
    if not targets:
        return
    starts = {axis: axis.status().position for axis in targets}
    ways = {axis: target - starts[axis] for axis, target in targets.items()}
    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, target in targets.items():
        axis.send(absolute(axis, target).message)
    watch(list(targets), limits, strays=beyond(starts, ways))
    for axis, target in targets.items():
        rest = axis.settled(axis.status())
        limit = (starts[axis] + target) // 2
        axis.trial.must(
            abs(rest.position - target) > axis.tolerance(ways[axis]),
            f"{axis.text}: with a software limit of {limit} and a profiled stop in {_SETTING}, "
            f"MOT_MOVE_ABSOLUTE from {starts[axis]} to {target} ended there; it should end before",
            rule="soft-limit-modes",
            cause=Cause(_SETTING, EFFECT),
            because=axis.spoilt,
            came=rest.heard.raw,
        )
    axes[0].trial.line.listen(0)


def _limit(axis: Axis) -> int | None:
    """Set the limit of a motor half-way to a target, and return the target; None if that is not possible."""
    direction = axis.direction_of(1)
    if direction is None:
        axis.trial.inconclusive(
            f"{axis.text} sent no status on its way, so the direction of each limit is unknown"
        )
        return None
    position = axis.status().position
    way = max(_LEAST, axis.pace.distance(_SECONDS))
    target = position + min(way, axis.room(position, 1))
    upper, lower = _FIELDS[direction]
    values = {
        upper: (position + target) // 2,
        lower: min(present(axis, _SETTING)[lower], max(0, position - HELD)),
        "software_limit_mode": int(SoftwareLimitMode.STOP_PROFILED),
    }
    change(axis, _SETTING, **values)
    return target

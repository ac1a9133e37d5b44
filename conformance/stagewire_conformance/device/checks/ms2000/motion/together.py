"""Two axes that move at the same time: each obeys only its own commands (sections 1, 16, 18 and 25)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    ARRIVED,
    MOVES,
    STOPS_BOTH,
    TARGET,
    Mover,
    lacks_of,
    motion_check,
)
from stagewire_conformance.device.checks.ms2000.motion.stops import (
    IGNORED,
    stop,
    stop_on_the_way,
)
from stagewire_conformance.device.checks.ms2000.motion.vector import KIND as VECTOR
from stagewire_conformance.device.checks.ms2000.motion.vector import (
    follow_to_speed,
    is_near,
    make_room,
    speed_for,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_FIRST, _SECOND = 0.3, 0.6
"""The durations of two moves in seconds."""
TWO_AXES: Final = Cause("motion", "two axes")
"""The defect that a move of one axis stops another one."""
_SHARE: Final = 5
"""An axis is stopped after a fifth of its way."""
_SHORT: Final = 4
"""An axis was stopped by mistake if more than a quarter of its way is left."""


TOGETHER: Final = Kind(
    name="move-together",
    title="Two axes that move at the same time are not confused",
    rules=(
        "axis-identifiers",
        "target-moves",
        "status-busy",
        "status-not-busy",
        "stop-disables",
    ),
)


def _pairs(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for first, second in pairwise(declared.places):
        yield AxisCase(
            place=first,
            name=second.name,
            arguments={"other": second},
            skip=second.why_none(MOVES),
            lacks=lacks_of(declared, allowed, second),
        )


@motion_check(
    TOGETHER,
    "{axis} and axis {other.name} move to their own targets at the same time",
    seconds=2.8,
    each=_pairs,
)
def _both(first: Mover, other: Target) -> None:
    second = Mover(first.trial, other)
    first.ready()
    second.ready()
    near, far = first.goal(_FIRST), second.goal(_SECOND)
    second.begin(m.WriteTargetPosition(far))
    first.begin(m.WriteTargetPosition(near))
    first.follow(f"on its way to {near}", abs(near - first.start))
    where = second.position
    if abs(where - far) > ARRIVED and not second.is_busy:
        stands = abs(second.position - where) <= DITHER
        first.trial.need(
            abs(second.position - far) <= ARRIVED,
            f"axis {second.name} {'has stopped' if stands else 'is not busy'} at {where} on its way to "
            f"{far}, after axis {first.name} was moved",
            wanted=b"B",
            came=b"b",
            rule="target-moves" if stands else "status-busy",
            cause=TWO_AXES if stands else Cause("READ_STATUS", "busy"),
        )
    second.follow(f"on its way to {far}", abs(far - second.start))
    judge_rest(first, near)
    judge_rest(second, far)


@motion_check(
    TOGETHER,
    "A stop of {axis} or of axis {other.name} leaves the other one moving",
    messages=("STOP_MOTOR", "START_MOTOR"),
    seconds=3.6,
    name="stop",
    each=_pairs,
)
def _stop_one(first: Mover, other: Target) -> None:
    """Stop one axis while both move away, and the other one while both move back."""
    first.trial.depends_on(TWO_AXES)
    second = Mover(first.trial, other)
    first.ready()
    second.ready()
    _stop_alone(first, second, {each: each.goal(_SECOND) for each in (first, second)})
    _stop_alone(second, first, {each: each.start for each in (first, second)})


def _stop_alone(stopped: Mover, going: Mover, goals: Mapping[Mover, int]) -> None:
    """Move two axes, and stop one of them on its way; the other one must arrive. Then start the first."""
    starts = {mover: mover.position for mover in goals}
    ways = {mover: abs(goal - starts[mover]) for mover, goal in goals.items()}
    if min(ways.values()) < _SHARE * ARRIVED:
        return
    going.begin(m.WriteTargetPosition(goals[going]))
    stopped.begin(m.WriteTargetPosition(goals[stopped]))
    seen = stopped.follow(
        f"on its way to {goals[stopped]}",
        ways[stopped],
        until=lambda at: abs(at.position - starts[stopped]) > ways[stopped] // _SHARE,
    )
    stop_on_the_way(stopped, seen[-1], goals[stopped])
    going.follow(f"on its way to {goals[going]}", ways[going])
    place = going.position
    arrived = abs(place - goals[going]) <= max(ARRIVED, ways[going] // _SHORT)
    for mover in (stopped,) if arrived else (stopped, going):
        mover.line.send(m.StartMotor(), mover.address)
        mover.follow("started", ways[mover])
    if arrived:
        _need_enabled(stopped, goals[stopped])
    stopped.trial.need(
        arrived,
        f"axis {stopped.name} was stopped, but axis {going.name} also stopped, at {place} on its way from "
        f"{starts[going]} to {goals[going]}; a command is for one axis",
        rule="axis-identifiers",
        cause=STOPS_BOTH,
    )


def _need_enabled(mover: Mover, goal: int) -> None:
    """Move an axis that was started to its target, unless it is there; end the check if it does not move."""
    place = mover.position
    if abs(place - goal) <= ARRIVED:
        return
    mover.line.send(m.WriteTargetPosition(goal), mover.address)
    mover.trial.need(
        mover.is_busy,
        f"axis {mover.name} was stopped at {place} and started again, but does not move to its target {goal}",
        rule="start-enables",
        cause=Cause("START_MOTOR", EFFECT),
        because=(TARGET,),
    )
    mover.follow(f"on its way to {goal}", abs(goal - place))


@motion_check(
    VECTOR,
    "{axis} and axis {other.name} move at their own vector speeds at the same time",
    messages=("WRITE_VECTOR_SPEED", "STOP_MOTOR", "START_MOTOR"),
    seconds=2.6,
    name="together",
    each=_pairs,
)
def _vectors(first: Mover, other: Target) -> None:
    """Move one axis up at a speed, then the other one at half of it: the first must keep its own."""
    first.trial.depends_on(IGNORED, Cause("WRITE_VECTOR_SPEED", EFFECT))
    second = Mover(first.trial, other)
    for mover in (first, second):
        mover.ready()
    for mover in (first, second):
        make_room(mover)
    fast = min(speed_for(first), 2 * speed_for(second))
    speeds = {first: fast, second: fast // 2}
    if any(speed < 20 for speed in speeds.values()):
        first.trial.inconclusive("the range leaves too little room for two speeds")
        raise EnoughError
    try:
        for mover, speed in speeds.items():
            mover.begin(m.WriteVectorSpeed(speed))
            follow_to_speed(mover, speed)
        for mover, speed in speeds.items():
            one = mover.sample()
            mover.line.listen(0.1)
            two = mover.sample()
            found = (two.position - one.position) / max(two.time - one.time, 1e-3)
            due = mover.counts_in(1.0, speed)
            mover.trial.must(
                is_near(found, due),
                f"axis {first.name} was commanded to move at {fast} µm/s, and then axis {second.name} at "
                f"{fast // 2} µm/s, but axis {mover.name} moved at "
                f"{found / mover.counts_in(1.0, 1):.0f} µm/s; each should keep its own speed",
                rule="vector-speed-runs",
                cause=Cause("WRITE_VECTOR_SPEED", "another axis"),
            )
    finally:
        for mover in speeds:
            stop(mover)

"""``move-stop``: a stopped move ends before its target, which is reported once (pages 49 and 50).

Another stop is sent at rest. Whether it is answered is left open, but it must not affect the next move.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import command_in
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    HELD,
    JITTER,
    STOPPED,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.course import is_speeding_up, points_of
from stagewire_conformance.device.checks.apt.motion.early_ends import judge_over
from stagewire_conformance.device.checks.apt.motion.judgement import (
    judge_end,
    judge_rest,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    Move,
    absolute,
    beyond,
    distances,
    move,
    relative,
)
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of
from stagewire_conformance.device.checks.apt.motion.runs import slow_down
from stagewire_conformance.device.checks.apt.motion.stopping import (
    StoppedMotion,
    judge_modes,
    judge_stopping,
)
from stagewire_conformance.device.checks.apt.motion.watch import Watched, watch
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.lines.strays import cause_of_stray, known_bytes

_SECONDS: Final = 1.0
"""The approximate duration of the move in seconds."""
_LEAST: Final = 0.4
"""The minimum duration in seconds that allows a stop before the motor slows down by itself."""
_SHARE: Final = 0.1
"""The fraction of the distance after which the motor is stopped."""
_AFTER: Final = 0.15
"""Seconds after which the position of a stopped motor is read again."""


KIND = Kind(
    name="move-stop",
    title="A stop ends a move, and the end is reported once",
    rules=(
        "stop-any-move",
        "stop-mode-values",
        "stop-completed",
        "stop-no-response",
        "relative-move",
        "absolute-move-completed",
        "move-stopped-status",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_STOP ends moves of {motors}, immediately and with a profile, and each "
    "reports it once",
    messages=("MOT_MOVE_STOP", STOPPED, "MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE", COMPLETED),
    does="starts moves of all motors within {range} and stops them on their way, once immediately "
    "and once with a profile, and sends another stop at rest",
    seconds=3.8,
)
def _run(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(Cause("MOT_MOVE_STOP", EFFECT))
    ways = distances(axes, _SECONDS)
    abrupt = set()  # motors that a profile stops within a few counts, because they were slowed down
    for axis, way in ways.items():
        if axis.pace.seconds(way) >= _LEAST:
            continue
        slow = _slow_down(axis, abs(way))
        if slow is None:
            axis.trial.inconclusive(
                f"a move of {abs(way)} counts ends before it can be stopped; allow a wider "
                "range, or settings, so that it can be made slower"
            )
            return
        if slow**2 / (2 * axis.pace.acceleration) < JITTER:
            abrupt.add(axis)
    at_once = _stop(
        {axis: absolute(axis, axis.start + way) for axis, way in ways.items()}, StopMode.IMMEDIATE
    )
    if not move([absolute(axis, axis.start, " after a stop") for axis in axes]):
        return
    slowly = _stop({axis: relative(axis, way) for axis, way in ways.items()}, StopMode.PROFILED)
    for axis in axes:
        if axis in at_once and axis in slowly and axis not in abrupt:
            judge_modes(axis, "", at_once[axis], slowly[axis])
    back = {axis: -stopped.signed // 2 for axis, stopped in slowly.items()}
    move([relative(axis, way, " after a stop") for axis, way in back.items() if abs(way) > HELD])


def _stop(moves: Mapping[Axis, Move], mode: StopMode) -> dict[Axis, StoppedMotion]:
    """Start moves, stop them, and judge the reaction."""
    axes = list(moves)
    starts = {axis: axis.status().position for axis in axes}
    ways = {axis: one.target - starts[axis] for axis, one in moves.items()}

    def on_its_way(axis: Axis, status: Status) -> bool:
        gone, left = abs(status.position - starts[axis]), abs(moves[axis].target - status.position)
        return gone >= max(JITTER + 1, abs(ways[axis]) * _SHARE) and left > axis.tolerance(
            ways[axis]
        )

    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, one in moves.items():
        axis.send(one.message)
    seen = watch(axes, limits, stop=on_its_way, mode=mode, strays=beyond(starts, ways))
    stood: dict[Axis, int] = {}
    for axis, one in moves.items():
        place = _judge(one, starts[axis], seen[axis], mode)
        if place is not None:
            stood[axis] = place
    line = axes[0].trial.line
    behind = line.listen(_AFTER)
    for axis, place in stood.items():
        now = axis.status().position
        axis.trial.must(
            abs(now - place) <= 2 * JITTER,  # it may have oscillated from one end to the other
            f"{axis.text}: after {STOPPED}, it moved on from {place} to {now}; it should stay "
            "where it stopped",
            rule="stop-any-move",
            cause=Cause("MOT_MOVE_STOP", EFFECT),
        )
    for heard in behind:
        axes[0].trial.must(
            False,
            f"after {STOPPED}, the controller sent {heard.text}; it should send nothing more",
            rule="stop-completed",
            cause=cause_of_stray(axes[0].trial.declared, heard),
            because=(
                *unstopped(axes[0].trial.declared),
                *known_bytes(axes[0].trial.causes, heard.raw),
            ),
            came=heard.raw,
        )
    for axis in axes:  # at rest: the next move must still end as usual
        axis.send(m.MotMoveStop(axis.channel, mode))
    line.listen(_AFTER)
    return {
        axis: StoppedMotion(
            stopped.position - starts[axis],
            abs(place - stopped.position),
            is_speeding_up(points_of(seen[axis].statuses)),
        )
        for axis, place in stood.items()
        if (stopped := seen[axis].stopped) is not None
    }


def _slow_down(axis: Axis, distance: int) -> float | None:
    """Slow the motor down so that moves over a distance take long enough.

    Return its velocity in counts/s; None if that is not allowed.
    """
    if not axis.trial.allowed.settings or not axis.place.messages.issuperset(
        messages_of("VELPARAMS")
    ):
        return None
    return slow_down(axis, 2 * distance, axis.pace)


def _judge(one: Move, start: int, seen: Watched, mode: StopMode) -> int | None:
    """Report how a stopped move ended, and return the position; None if unknown."""
    axis, target = one.axis, one.target
    told = f"MOT_MOVE_STOP {mode.name.lower()} in {one.told}"
    if seen.stopped is None or _was_over(axis, start, target, seen):
        if seen.ends and seen.strayed is None:
            axis.trial.inconclusive(f"{axis.text}: {one.told} ended before it could be stopped")
        else:
            judge_end(axis, one.told, seen, COMPLETED)
        return None
    if not judge_stopping(axis, told, start, seen, mode):
        return None
    end = judge_end(axis, told, seen, STOPPED)
    if end is None:
        return None
    if not judge_over(
        axis,
        told,
        end,
        seen,
        strays=beyond({axis: start}, {axis: target - start}),
        ignored=lambda axis, status: (
            abs(status.position - target) <= axis.tolerance(target - start)
        ),
    ):
        return None
    place = judge_rest(axis, told, end, seen).position
    if abs(place - target) <= axis.tolerance(target - start):
        axis.trial.inconclusive(f"{axis.text}: after {told}, it had almost arrived, at {place}")
        return place
    axis.trial.must(
        min(start, target) < place < max(start, target),
        f"{axis.text}: after {told}, it is at {place}; it should have stopped between "
        f"{start} and {target}",
        rule="stop-any-move",
        cause=Cause("MOT_MOVE_STOP", EFFECT),
        because=(*axis.doubts, Cause(command_in(one.told), EFFECT)),
    )
    return place


def _was_over(axis: Axis, start: int, target: int, seen: Watched) -> bool:
    """Return whether a motor arrived at the moment of the stop command."""
    names = [end.name for end in seen.ends]
    missed = abs(axis.status().position - target)
    return names == [COMPLETED, STOPPED] and missed <= axis.tolerance(target - start)

"""Moves: started, watched to their ends, and judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_command, rule_of_miss
from stagewire_conformance.device.checks.apt.motion.apart import (
    CONFUSED,
    rule_of_apart,
    start,
)
from stagewire_conformance.device.checks.apt.motion.arrival import judge_place, judge_positions
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    HELD,
    JITTER,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.course import points_of, top_speed
from stagewire_conformance.device.checks.apt.motion.early_ends import judge_early
from stagewire_conformance.device.checks.apt.motion.judgement import (
    judge_course,
    judge_end,
    judge_no_reply,
    judge_rest,
)
from stagewire_conformance.device.checks.apt.motion.speed_notes import note_speed
from stagewire_conformance.device.checks.apt.motion.watch import (
    Decision,
    Watched,
    drop_ends,
    is_outside,
    watch,
)
from stagewire_conformance.device.results import Result

if TYPE_CHECKING:
    from stagewire import FramedMessage
    from stagewire_apt.enumerations import MoveDirection
    from stagewire_conformance.device.checks.apt.motion.pace import Pace


_LESS: Final = 0.75
"""The ratio of the distances of successive motors, which makes the motors distinguishable."""
_LEAST: Final = 200
"""Counts of the shortest distance that is measured."""


@dataclass(frozen=True)
class Move:
    """A move of one motor.

    :param message: the message to send.
    :param target: the target position in counts. For a jog in a direction of unknown sign, one of the two
        possible targets.
    :param told: the command, for sentences.
    :param jog: the pace of a jog; None for another move.
    :param direction: the direction of a jog.
    :param rule: the rule about its end message; by default that of the command.
    :param accurate: whether even a small distance from the target is reported.
    """

    axis: Axis
    message: FramedMessage
    target: int
    told: str
    jog: Pace | None = None
    direction: MoveDirection | None = None
    rule: str = ""
    accurate: bool = False


def absolute(axis: Axis, target: int, about: str = "") -> Move:
    """Return a move to a position."""
    return Move(
        axis,
        m.MotMoveAbsolute(axis.channel, target),
        target,
        f"MOT_MOVE_ABSOLUTE to {target}{about}",
    )


def relative(axis: Axis, way: int, about: str = "") -> Move:
    """Return a move by a distance from the current position."""
    target = axis.status().position + way
    message = m.MotMoveRelative(axis.channel, way)
    return Move(axis, message, target, f"MOT_MOVE_RELATIVE by {way}{about}")


def jog(axis: Axis, direction: MoveDirection, step: int, pace: Pace) -> Move:
    """Return a jog by a set step from the current position."""
    target = axis.status().position + (axis.way_of(direction) or 1) * step
    told = f"MOT_MOVE_JOG {direction.name.lower()} by a step of {step}"
    message = m.MotMoveJog(axis.channel, direction)
    return Move(axis, message, target, told, jog=pace, direction=direction)


def make_room(distances: Mapping[Axis, int]) -> bool:
    """Move motors to positions with room for a distance both up and down; return whether all arrived.

    The sign of a commanded direction is not known beforehand.
    """
    places = {axis: axis.place_with_room(distance) for axis, distance in distances.items()}
    moves = [absolute(axis, place) for axis, place in places.items() if place != axis.start]
    return not moves or move(moves)


def distances(axes: Sequence[Axis], seconds: float) -> dict[Axis, int]:
    """Return a distance for each motor, each of a different length, from the duration of a move."""
    return {
        axis: axis.distance(axis.start, seconds * _LESS**index) for index, axis in enumerate(axes)
    }


def long_enough(ways: Mapping[Axis, int], otherwise: str) -> dict[Axis, int]:
    """Return the distances that are long enough to be measured.

    :param otherwise: what the other motors report, with the distance in braces.
    """
    for axis, way in ways.items():
        if abs(way) < _LEAST:
            axis.trial.inconclusive(
                f"{axis.text}: {otherwise.format(abs(way))}; allow a wider range, or set a "
                "higher velocity and acceleration"
            )
    return {axis: way for axis, way in ways.items() if abs(way) >= _LEAST}


def move(moves: Sequence[Move]) -> bool:
    """Send commands that move motors together, and judge the reaction; return whether all arrived.

    Targets outside of the range are left out; they occur if a motor is not where it should be.
    """
    moves = [
        each
        for each in moves
        if each.axis.low - HELD
        <= each.target
        <= each.axis.high + HELD  # relative to a position that may oscillate
    ]
    if not moves:
        return False
    moves[0].axis.trial.depends_on(Cause(COMPLETED, "early"))
    starts = {each.axis: each.axis.status().position for each in moves}
    ways = {each.axis: each.target - starts[each.axis] for each in moves}
    limits = {each.axis: (each.jog or each.axis.pace).bound(ways[each.axis]) for each in moves}
    jogs = any(each.jog for each in moves)
    start({each.axis: each.message for each in moves}, first_alone=jogs)
    seen = watch(list(ways), limits, strays=beyond(starts, ways))
    for each in moves:
        axis = each.axis
        note_speed(axis, seen[axis].statuses, each.jog or axis.pace)
        axis.speeds.append(top_speed(points_of(seen[axis].statuses)))
    arrived = [_judge(each, starts[each.axis], seen[each.axis]) for each in moves]
    return all(arrived)


def beyond(starts: Mapping[Axis, int], ways: Mapping[Axis, int]) -> Decision:
    """Return whether a motor is further from its start than its move and its backlash can bring it.

    It may go half as far again: a moderate overshoot is judged when the move has ended.
    """
    most = {
        axis: abs(way) + max(4 * HELD, abs(way) // 2) + abs(axis.backlash)
        for axis, way in ways.items()
    }

    def strays(axis: Axis, status: Status) -> bool:
        return is_outside(axis, status) or abs(status.position - starts[axis]) > most[axis]

    return strays


def _judge(one: Move, start: int, seen: Watched) -> bool:
    axis, direction = one.axis, one.direction
    if direction is not None and not axis.clockwise:
        one = _as_it_went(one, start, seen)
    judge_course(
        axis,
        one.told,
        seen.statuses,
        start,
        one.target,
        direction=direction,
        jogging=one.jog is not None,
    )
    stayed = not seen.ends and abs(one.target - start) > HELD and not _has_moved(start, seen)
    rule = rule_of_command(one.told) if stayed else one.rule
    end = judge_end(axis, one.told, seen, COMPLETED, rule=rule)
    judge_no_reply(axis, one.told, seen)
    if end is None:
        return False
    if end.name == COMPLETED and not judge_early(axis, one.told, end, seen, one.target):
        return False
    rest = judge_rest(axis, one.told, end)
    arrived = judge_place(axis, one.told, rest, start, one.target, accurate=one.accurate)
    if arrived:
        judge_positions(axis, one.told, seen.statuses, start, one.target)
    if arrived and direction is not None:
        axis.learn(1 if one.target > start else -1, direction)
    return arrived


def _has_moved(start: int, seen: Watched) -> bool:
    """Return whether a motor has moved, or has reported motion."""
    return any(each.moving or abs(each.position - start) > HELD for each in seen.statuses)


def _as_it_went(one: Move, start: int, seen: Watched) -> Move:
    """Return a jog with its target on the side to which the motor went."""
    gone = next((place - start for place in _places(seen) if place != start), 0)
    if gone * (one.target - start) >= 0:
        return one
    return replace(one, target=2 * start - one.target)


def _places(seen: Watched) -> Iterator[int]:
    """Yield the positions that a motor reported, the last one first."""
    for end in reversed(seen.ends):
        if hasattr(end.message, "position"):
            yield end.message.position
    yield from (status.position for status in reversed(seen.statuses))


def returning(axes: Sequence[Axis]) -> None:
    """Move the motors back together at the end of the check."""
    where = " and ".join(axis.text for axis in axes)
    axes[0].trial.undo(
        f"position of {where}",
        lambda: go_back(axes),
        moves=True,
        rule="absolute-move",
        because=lambda: [doubt for axis in axes for doubt in axis.doubts],
    )


def go_back(axes: Sequence[Axis]) -> None:
    """Move motors that are not at their initial positions back to them.

    If the check has a finding, move all of them: the positions that they report may be wrong, and the next
    check must not begin at an unknown position.

    A motor that does not arrive is stopped, and reported.
    """
    away = {}
    inside = set()
    trusted = axes[0].trial.result is Result.PASS
    for axis in axes:
        status = axis.settled(axis.status())
        if status.moving:
            status = axis.halt()
        if not trusted or abs(status.position - axis.start) > JITTER:
            away[axis] = axis.start - status.position
            if not is_outside(axis, status):
                inside.add(axis)
    if not away:
        return
    axes[0].trial.line.listen(0)  # end messages of earlier stops do not belong to the way back

    def goes_away(axis: Axis, status: Status) -> bool:
        distance = abs(away[axis]) + abs(axis.backlash)
        leaves = axis in inside and is_outside(axis, status)
        return leaves or abs(status.position - axis.start) > distance + HELD

    for axis in away:
        axis.send(m.MotMoveAbsolute(axis.channel, axis.start))
    limits = {axis: axis.pace.limit(distance) for axis, distance in away.items()}
    seen = watch(list(away), limits, strays=goes_away)
    for axis, distance in away.items():
        status = axis.settled(axis.status())
        near = max(HELD, abs(distance) // 200)
        if abs(status.position - axis.start) > near:
            status = axis.standing()  # its end message may have come too early
        if len(away) > 1 and not status.moving and abs(status.position - axis.start) > near:
            status = _go_back_alone(axis, next(other for other in away if other is not axis))
        if status.moving or abs(status.position - axis.start) > near:
            status = axis.halt()
            drop_ends(axis)  # those of the stops just sent
            strayed = seen[axis].strayed
            stopped = f", stopped when it reached {strayed.position}" if strayed else ""
            axis.trial.need(
                False,
                f"not restored: {axis.text} is at {status.position} after MOT_MOVE_ABSOLUTE to "
                f"{axis.start}{stopped}; move it there",
                rule=rule_of_miss("MOT_MOVE_ABSOLUTE", status.position - axis.start, distance),
                cause=axis.cause_of_miss(
                    "MOT_MOVE_ABSOLUTE", status.position - axis.start, distance
                ),
                because=axis.doubts,
                came=status.heard.raw,
            )


def _go_back_alone(axis: Axis, other: Axis) -> Status:
    """Move a motor back that has stopped on its way while others moved, and return its status.

    If it then arrives, report that the motors are confused.
    """
    status = axis.status()
    away = axis.start - status.position
    axis.send(m.MotMoveAbsolute(axis.channel, axis.start))

    def goes_away(axis: Axis, status: Status) -> bool:
        return abs(status.position - axis.start) > abs(away) + abs(axis.backlash) + HELD

    watch([axis], {axis: axis.pace.limit(away)}, strays=goes_away)
    stood, status = status, axis.settled(axis.status())
    arrived = abs(status.position - axis.start) <= max(HELD, abs(away) // 200)
    axis.trial.must(
        not arrived or status.moving,
        f"{axis.text} stopped at {stood.position} on its way to {axis.start}, while {other.text} also moved, "
        "and arrived only when it moved alone; a command to one motor should not affect another",
        rule=rule_of_apart(axis, other),
        cause=CONFUSED,
        because=axis.doubts,
        came=stood.heard.raw,
    )
    return status

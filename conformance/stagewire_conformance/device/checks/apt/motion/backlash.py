"""``backlash``: a move goes beyond its target by the backlash distance, and comes back (page 34).

This happens in one of the two directions, and with the opposite sign of the distance in the other one. No
page states which, so both are accepted. A stop also ends a move while it comes back (page 49).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    HELD,
    JITTER,
    STOPPED,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.judgement import judge_end
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    absolute,
    long_enough,
    make_room,
    move,
)
from stagewire_conformance.device.checks.apt.motion.parameters import change, messages_of
from stagewire_conformance.device.checks.apt.motion.shuttle import Shuttle
from stagewire_conformance.device.checks.apt.motion.stopping import IGNORED
from stagewire_conformance.device.checks.apt.motion.watch import watch

_SECONDS: Final = 0.25
"""The approximate duration in seconds of the move, and of the way beyond its target."""
_OBSERVABLE: Final = 0.02
"""The duration in seconds of a way that several statuses show."""
_QUICK: Final = 0.1
"""The duration in seconds of a move of unknown pace that may be too short to show such a way."""
_TOO_QUICK: Final = (
    "{axis.text}: moves of {counts} counts end before the way beyond their target can be observed; allow a "
    "wider range, or set a lower velocity and acceleration"
)
_STOP: Final = ("MOT_MOVE_STOP", STOPPED)


KIND = Kind(
    name="backlash",
    title="A move corrects the backlash by its distance",
    rules=("backlash-parameters", "stop-any-move", "stop-completed"),
)


@motor_check(
    KIND,
    "MOT_SET_GENMOVEPARAMS sets how far {motors} go beyond their targets",
    messages=(
        "MOT_MOVE_ABSOLUTE",
        *messages_of("GENMOVEPARAMS"),
        COMPLETED,
    ),
    does="sets a positive and a negative backlash distance with MOT_SET_GENMOVEPARAMS, moves all motors "
    "together back and forth within {range}, stops the last move after its turn, and restores the parameters",
    settings=True,
    seconds=4.6,
    also=_STOP,
)
def _corrects(axes: Sequence[Axis]) -> None:
    distances = {axis: axis.step(_SECONDS, axis.pace) // 2 for axis in axes}
    distances = long_enough(
        distances, "a backlash distance of {} counts is too short to be observed"
    )
    for axis in [axis for axis, each in distances.items() if _is_too_quick(axis, each)]:
        axis.trial.inconclusive(_TOO_QUICK.format(axis=axis, counts=distances.pop(axis)))
    if not distances or not make_room({axis: 2 * each for axis, each in distances.items()}):
        return
    begins = {axis: axis.place_with_room(2 * each) for axis, each in distances.items()}
    with_positive = _overshoots(distances, begins, 1)
    with_negative = _overshoots(distances, begins, -1)
    right = [
        axis
        for axis in with_negative
        if axis in with_positive
        and _judge(axis, distances[axis], with_positive[axis], with_negative[axis])
    ]
    _stop_after_the_turn({axis: distances[axis] for axis in right}, begins, with_negative)


def _is_too_quick(axis: Axis, distance: int) -> bool:
    return axis.pace.known and axis.pace.seconds(distance) < _OBSERVABLE


def _overshoots(
    distances: Mapping[Axis, int], begins: Mapping[Axis, int], sign: int
) -> dict[Axis, tuple[int, int]]:
    """Move up and down with a backlash distance; return how far each motor went beyond both targets."""
    for axis, distance in distances.items():
        change(axis, "MOT_SET_GENMOVEPARAMS", backlash_distance=sign * distance)
    shuttle = Shuttle(distances, begins, {axis: abs(way) for axis, way in distances.items()})
    up = shuttle.overshoots(list(distances))
    down = shuttle.overshoots(list(up))
    found = {axis: (up[axis], down[axis]) for axis in down}
    for axis, overs in list(found.items()):
        seconds = min(course.seconds for course in shuttle.courses[axis])
        if not axis.pace.known and seconds < _QUICK and max(overs) < distances[axis] // 2:
            axis.trial.inconclusive(_TOO_QUICK.format(axis=axis, counts=distances[axis]))
            del found[axis]
    return found


def _stop_after_the_turn(
    distances: Mapping[Axis, int],
    begins: Mapping[Axis, int],
    overshoots: Mapping[Axis, tuple[int, int]],
) -> None:
    """Move in the direction in which the motors correct their backlash, and stop them on the way back."""
    axes = [axis for axis in distances if axis.place.messages.issuperset(_STOP)]
    if not axes:
        return
    axes[0].trial.depends_on(IGNORED)
    ways = {axis: 1 if overshoots[axis][0] >= overshoots[axis][1] else -1 for axis in axes}
    targets = {axis: begins[axis] + max(0, ways[axis]) * distances[axis] for axis in axes}
    starts = {axis: targets[axis] - ways[axis] * distances[axis] for axis in axes}
    away = [absolute(axis, at) for axis, at in starts.items() if abs(axis.position() - at) > HELD]
    if away and not move(away):
        return
    furthest = dict(starts)

    def turned(axis: Axis, status: Status) -> bool:
        """Return whether a motor is at the beginning of its way back to its target."""
        way = ways[axis]
        furthest[axis] = way * max(way * furthest[axis], way * status.position)
        left = (status.position - targets[axis]) * way
        return (furthest[axis] - status.position) * way > JITTER and left > distances[axis] // 2

    told = {axis: f"MOT_MOVE_ABSOLUTE to {targets[axis]}" for axis in axes}
    limits = {}
    for axis in axes:
        limits[axis] = 2 * axis.pace.bound(2 * distances[axis])
        axis.send(m.MotMoveAbsolute(axis.channel, targets[axis]))
    seen = watch(axes, limits, stop=turned, mode=StopMode.IMMEDIATE)
    for axis, each in seen.items():
        if each.stopped is None:
            continue  # it was near its target at the first status after the turn
        stop = f"MOT_MOVE_STOP immediate in {told[axis]}, on the way back to it"
        rest = axis.standing()
        if axis.trial.must(
            (rest.position - targets[axis]) * ways[axis] > distances[axis] // 8,
            f"{axis.text}: after {stop} at {each.stopped.position}, it went on to {rest.position}; it should "
            "have stopped at once",
            rule="stop-any-move",
            cause=IGNORED,
            came=rest.heard.raw,
        ):
            judge_end(axis, stop, each, STOPPED)


def _judge(axis: Axis, distance: int, positive: tuple[int, int], negative: tuple[int, int]) -> bool:
    """Report overshoots that do not correct the backlash; return whether they do."""
    first, second = ([over >= distance // 2 for over in each] for each in (positive, negative))
    told = (
        f"{axis.text}: with a backlash distance of {distance}, moves up and down went {positive[0]} and "
        f"{positive[1]} counts beyond their targets, and with {-distance}, {negative[0]} and {negative[1]}"
    )
    return axis.trial.must(
        any(first) and any(second),
        f"{told}; moves in one direction should go beyond them by the distance",
        rule="backlash-parameters",
        because=axis.doubts,
    ) and axis.trial.must(
        first != second,
        f"{told}; the sign of the distance should decide in which direction",
        rule="backlash-parameters",
    )

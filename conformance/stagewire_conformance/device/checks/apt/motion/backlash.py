"""``backlash``: a move goes beyond its target by the backlash distance, and comes back (page 34).

This happens in one of the two directions, and with the opposite sign of the distance in the other one. No
page states which, so both are accepted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import long_enough, make_room
from stagewire_conformance.device.checks.apt.motion.parameters import change, messages_of
from stagewire_conformance.device.checks.apt.motion.shuttle import Shuttle

_SECONDS: Final = 0.25
"""The approximate duration in seconds of the move, and of the way beyond its target."""


KIND = Kind(
    name="backlash",
    title="A move corrects the backlash by its distance",
    rules=("backlash-parameters",),
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
    "together back and forth within {range}, and restores the parameters",
    settings=True,
    seconds=3.6,
)
def _corrects(axes: Sequence[Axis]) -> None:
    distances = {axis: axis.step(_SECONDS, axis.pace) // 2 for axis in axes}
    distances = long_enough(
        distances, "a backlash distance of {} counts is too short to be observed"
    )
    if not distances or not make_room({axis: 2 * each for axis, each in distances.items()}):
        return
    begins = {axis: axis.place_with_room(2 * each) for axis, each in distances.items()}
    with_positive = _overshoots(distances, begins, 1)
    with_negative = _overshoots(distances, begins, -1)
    for axis in with_positive.keys() & with_negative.keys():
        _judge(axis, distances[axis], with_positive[axis], with_negative[axis])


def _overshoots(
    distances: Mapping[Axis, int], begins: Mapping[Axis, int], sign: int
) -> dict[Axis, tuple[int, int]]:
    """Move up and down with a backlash distance; return how far each motor went beyond both targets."""
    for axis, distance in distances.items():
        change(axis, "MOT_SET_GENMOVEPARAMS", backlash_distance=sign * distance)
    shuttle = Shuttle(distances, begins, {axis: abs(way) for axis, way in distances.items()})
    up = shuttle.overshoots(list(distances))
    down = shuttle.overshoots(list(up))
    return {axis: (up[axis], down[axis]) for axis in down}


def _judge(axis: Axis, distance: int, positive: tuple[int, int], negative: tuple[int, int]) -> None:
    first, second = ([over >= distance // 2 for over in each] for each in (positive, negative))
    told = (
        f"{axis.text}: with a backlash distance of {distance}, moves up and down went {positive[0]} and "
        f"{positive[1]} counts beyond their targets, and with {-distance}, {negative[0]} and {negative[1]}"
    )
    if axis.trial.must(
        any(first) and any(second),
        f"{told}; moves in one direction should go beyond them by the distance",
        rule="backlash-parameters",
        because=axis.doubts,
    ):
        axis.trial.must(
            first != second,
            f"{told}; the sign of the distance should decide in which direction",
            rule="backlash-parameters",
        )

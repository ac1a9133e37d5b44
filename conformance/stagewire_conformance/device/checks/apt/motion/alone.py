"""``move-alone``: of several motors, only the addressed one obeys, and only it reports it (pages 9 and 17).

The other checks move all motors together, and rely on this.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.apart import (
    judge_others,
    judge_stop_alone,
    need_apart,
    need_source,
)
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    HELD,
    STOPPED,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import APART, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute, beyond, distances
from stagewire_conformance.device.checks.apt.motion.watch import watch

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS: Final = 0.4
"""The approximate duration of a move in seconds."""
_LESS: Final = 0.9
"""The ratio of the distances of successive motors, so that their targets differ."""
_SHARE: Final = 8
"""A motor is stopped after an eighth of its way."""
_SHORT: Final = 4
"""A motor was stopped by mistake if more than a quarter of its way is left."""


KIND = Kind(
    name="move-alone",
    title="Of several motors, only the addressed one moves and stops",
    rules=APART,
)


@motor_check(
    KIND,
    "Of {motors}, only the addressed motor moves and stops, and only it reports it",
    messages=("MOT_MOVE_ABSOLUTE", "MOT_MOVE_STOP", STOPPED, COMPLETED),
    does="moves one motor after the other within {range}, and back, and stops the last one on its way "
    "while the others move",
    seconds=2.2,
    at_least=2,
)
def _one_alone(axes: Sequence[Axis]) -> None:
    ways = {
        axis: int(way * _LESS**index)
        for index, (axis, way) in enumerate(distances(axes, _SECONDS).items())
    }
    *others, last = axes
    for axis in others:
        _move_alone(axis, axis.start + ways[axis], [each for each in axes if each is not axis])
    _stop_alone(last, ways, others)
    _move_alone(last, last.start, others)


def _move_alone(axis: Axis, target: int, others: Sequence[Axis]) -> None:
    """Move one motor; the others must stay where they are, and must not report the move."""
    stood = {other: other.status().position for other in others}
    start = axis.status().position
    way = {axis: target - start}
    axis.send(absolute(axis, target).message)
    seen = watch([axis], {axis: axis.pace.bound(target - start)}, strays=beyond({axis: start}, way))
    judge_others(axis, "MOT_MOVE_ABSOLUTE", stood)
    _judge_source(axis, "MOT_MOVE_ABSOLUTE", seen[axis].ends, others)
    if not seen[axis].ends:  # which another check reports
        axis.halt()


def _stop_alone(last: Axis, ways: Mapping[Axis, int], others: Sequence[Axis]) -> None:
    """Move the last motor away and the others back, and stop only the last one on its way."""
    axes = [*others, last]
    starts = {axis: axis.status().position for axis in axes}
    targets = {axis: axis.start for axis in others} | {last: last.start + ways[last]}
    gaps = {axis: targets[axis] - starts[axis] for axis in axes}

    def on_its_way(axis: Axis, status: Status) -> bool:
        return axis is last and abs(status.position - starts[axis]) > abs(gaps[axis]) // _SHARE

    for axis in axes:
        axis.send(absolute(axis, targets[axis]).message)
    limits = {axis: axis.pace.bound(way) for axis, way in gaps.items()}
    seen = watch(axes, limits, stop=on_its_way, strays=beyond(starts, gaps))
    if seen[last].stopped is not None:
        judge_stop_alone(last, {axis: seen[axis] for axis in others})
        for axis in others:
            rest = axis.standing()
            need_apart(
                abs(rest.position - targets[axis]) <= max(HELD, abs(gaps[axis]) // _SHORT),
                last,
                axis,
                f"MOT_MOVE_STOP was sent to {last.text}, but {axis.text} also stopped, at "
                f"{rest.position} on its way from {starts[axis]} to {targets[axis]}; it should move on",
                rest.heard,
            )
    for axis in axes:
        axis.standing()
    last.trial.line.listen(0)


def _judge_source(
    axis: Axis, command: str, ends: Sequence[Incoming], others: Sequence[Axis]
) -> None:
    """Report an end message from a motor that was not commanded to move."""
    mine = [end for end in ends if end.source == axis.place.address and end.channel == axis.channel]
    for other in others:
        for end in ends:
            if end.source == other.place.address != axis.place.address and not mine:
                need_source(axis, command, other, end)

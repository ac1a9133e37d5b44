"""``in-motion``: the replies of a moving motor agree with each other (pages 28 and 81)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import COMPLETED, absolute, distances
from stagewire_conformance.device.checks.apt.motion.replies_together import (
    judge_bits_alone,
    judge_counter,
)
from stagewire_conformance.device.checks.apt.motion.watch import watch

_SECONDS: Final = 0.5
"""The approximate duration of the move in seconds."""


KIND = Kind(
    name="in-motion",
    title="The replies of a moving motor agree with each other",
    rules=("status-bits-same", "position-counter-absolute"),
)


@motor_check(
    KIND,
    "The replies of {motors} agree with each other during a move",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range} and back, and reads their position counters and status "
    "bits meanwhile",
    also=("MOT_REQ_STATUSBITS", "MOT_GET_STATUSBITS", "MOT_REQ_POSCOUNTER", "MOT_GET_POSCOUNTER"),
)
def _agree(axes: Sequence[Axis]) -> None:
    ways = distances(axes, _SECONDS)
    right = dict.fromkeys(axes, True)

    def compare(axis: Axis, status: Status) -> bool:
        """Compare the replies of a moving motor once per status, until they differ."""
        if right[axis] and status.moving:
            when = f"on its way after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}"
            right[axis] = judge_bits_alone(axis, when) and judge_counter(axis, when, axis.status())
        return False

    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    seen = watch(axes, limits, done=compare)
    for axis in axes:
        if not seen[axis].ends:
            axis.halt()

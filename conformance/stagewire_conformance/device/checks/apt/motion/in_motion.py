"""``in-motion``: the replies of a moving motor agree with each other (pages 28, 29 and 81)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute
from stagewire_conformance.device.checks.apt.motion.replies_together import (
    EncoderReadings,
    judge_bits_alone,
    judge_counter,
    judge_fresh_bits,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting
from stagewire_conformance.device.checks.apt.motion.watch import watch

_SECONDS: Final = 0.5
"""The approximate duration of the move in seconds."""
_BEGUN: Final = 0.15
"""Seconds after which a motor that has been commanded to move reports motion."""


KIND = Kind(
    name="in-motion",
    title="The replies of a moving motor agree with each other",
    rules=(
        "status-bits-same",
        "position-counter-absolute",
        "encoder-counter-after-homing",
        "status-position",
        "dc-status-position",
    ),
)


@motor_check(
    KIND,
    "The replies of {motors} agree with each other during a move",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range} and back, and reads their counters and status bits "
    "meanwhile",
    seconds=2.2,
    also=("MOT_REQ_ENCCOUNTER", "MOT_GET_ENCCOUNTER"),
)
def _agree(axes: Sequence[Axis]) -> None:
    ways = distances_lasting(axes, _SECONDS)
    right = dict.fromkeys(axes, True)
    looks = dict.fromkeys(axes, 0)
    encoders = {axis: EncoderReadings(axis) for axis in axes}

    def compare(axis: Axis, status: Status) -> bool:
        """Compare the replies of a moving motor, until they differ: its counters in turn.

        More requests could make a controller fall silent before the next keep-alive message (page 80).
        """
        looks[axis] += status.moving
        if status.moving and looks[axis] % 2:
            encoders[axis].read()
        elif right[axis] and status.moving:
            when = f"on its way after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}"
            ends = axis.start, axis.start + ways[axis]
            right[axis] = judge_bits_alone(axis, when) and judge_counter(
                axis, when, axis.status(), ends
            )
        return False

    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    axes[0].pause(_BEGUN)
    for axis in axes:
        judge_fresh_bits(axis, f"{_BEGUN:g} s after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}")
    seen = watch(axes, limits, done=compare)
    for axis in axes:
        if not seen[axis].ends:
            axis.halt()
        encoders[axis].judge(f"on its way after MOT_MOVE_ABSOLUTE to {axis.start + ways[axis]}")

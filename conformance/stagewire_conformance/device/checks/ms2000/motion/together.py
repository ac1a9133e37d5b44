"""Two axes at once: each goes to its own target, and is busy as long as it goes itself."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase
from stagewire_conformance.device.checks.ms2000.motion.judging import judge_rest
from stagewire_conformance.device.checks.ms2000.motion.motion_check import (
    MOVES,
    lacks_of,
    motion_check,
)
from stagewire_conformance.device.checks.ms2000.motion.mover import ARRIVED, Mover
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.places import Target
from stagewire_ms2000 import messages as m

_FIRST, _SECOND = 0.3, 0.6
"""Seconds that the two moves take."""


KIND: Final = Kind(
    name="move-together",
    title="Two axes that move at once do not mix",
    rules=("axis-identifiers", "target-moves", "status-busy", "status-not-busy"),
)


def _pairs(declared: Declared, allowed: Permissions) -> Iterator[AxisCase]:
    for first, second in pairwise(declared.places):
        yield AxisCase(
            place=first,
            name=second.name,
            words={"other": second.name},
            arguments={"other": second},
            skip=next(filter(None, map(second.why_not, MOVES)), ""),
            lacks=lacks_of(declared, allowed, second),
        )


@motion_check(
    KIND, "{axis} and axis {other} go to their own targets at once", seconds=1.5, each=_pairs
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
    if abs(where - far) > ARRIVED:
        first.trial.must(
            second.is_busy or abs(second.position - far) <= ARRIVED,
            f"axis {second.name} is not busy at {where} on its way to {far}; axis {first.name} had arrived",
            wanted=b"B",
            came=b"b",
        )
    second.follow(f"on its way to {far}", abs(far - second.start))
    judge_rest(first, near)
    judge_rest(second, far)

"""``move-alone``: of several motors only the one that is told to moves, and only it says so (pages 9 and 17).

Bays differ by the address of their messages alone, channels of a module by the channel that they name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import JITTER, Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    absolute,
    distances,
    move,
)
from stagewire_conformance.device.checks.apt.motion.rules import APART

if TYPE_CHECKING:
    pass


_SECONDS: Final = 0.25


KIND = Kind(
    name="move-alone",
    title="Of several motors only the one that is told to moves",
    rules=("absolute-move", *APART),
)


@motor_check(
    KIND,
    "Of {} only the motor that is told to moves, and only it says so",
    messages=("MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves one motor after the other within {}, and back",
    at_least=2,
)
def _run(axes: Sequence[Axis]) -> None:
    for axis, way in distances(axes, _SECONDS).items():
        target = axis.start + way
        others = [other for other in axes if other is not axis]
        stood = {other: other.status().position for other in others}
        arrived = move([absolute(axis, target)])
        for other in others:
            status = other.status()
            axis.trial.must(
                abs(status.position - stood[other])
                <= 2 * JITTER,  # from one end of it to the other
                f"{axis.text} was told to move alone, and {other.text} went from {stood[other]} to "
                f"{status.position}; it should stand",
                came=status.heard.raw,
            )
        if not arrived:
            return

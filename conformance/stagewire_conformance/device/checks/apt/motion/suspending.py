"""``suspend``: end messages that are suspended do not come, and come again when resumed (82 and 83)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, Status
from stagewire_conformance.device.checks.apt.motion.judging import judge_place, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    absolute,
    distances,
    move,
)
from stagewire_conformance.device.checks.apt.motion.watching import watch
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    pass


_SECONDS: Final = 0.25
_AFTER: Final = 0.2
"""Seconds in which an end message would come behind the end of a move."""


KIND = Kind(
    name="suspend",
    title="End messages can be suspended and resumed",
    rules=("end-messages-suspended", "end-messages-resumed"),
)


@motor_check(
    KIND,
    "End messages of {} can be suspended and resumed",
    messages=(
        "MOT_SUSPEND_ENDOFMOVEMSGS",
        "MOT_RESUME_ENDOFMOVEMSGS",
        "MOT_MOVE_ABSOLUTE",
        COMPLETED,
    ),
    does="moves all motors at once within {} while their end messages are suspended, and back when they "
    "are resumed",
)
def _run(axes: Sequence[Axis]) -> None:
    trial = axes[0].trial
    ways = distances(axes, _SECONDS)

    def arrived(axis: Axis, status: Status) -> bool:
        missed = status.position - axis.start - ways[axis]
        return not status.moving and abs(missed) <= axis.tolerance(ways[axis])

    trial.undo("end messages, resumed", lambda: _tell(axes, m.MotResumeEndOfMoveMsgs()))
    _tell(axes, m.MotSuspendEndOfMoveMsgs())
    for axis, way in ways.items():
        axis.send(m.MotMoveAbsolute(axis.channel, axis.start + way))
    seen = watch(axes, {axis: axis.pace.limit(way) for axis, way in ways.items()}, done=arrived)
    behind = trial.line.listen(_AFTER)
    for axis, way in ways.items():
        target = axis.start + way
        told = f"MOT_MOVE_ABSOLUTE to {target}, end messages being suspended"
        mine = [
            each
            for each in behind
            if each.source == axis.place.address and each.channel == axis.channel
        ]
        came = [*seen[axis].ends, *mine]
        trial.must(
            not came,
            f"{axis.text}: after {told}, there came {', '.join(each.name or each.text for each in came)}; "
            "nothing should come",
            came=raw_of(came),
        )
        if not judge_place(axis, told, judge_rest(axis, told), axis.start, target):
            axis.halt()
    _tell(axes, m.MotResumeEndOfMoveMsgs())
    move([absolute(axis, axis.start, ", end messages being resumed") for axis in axes])


def _tell(
    axes: Sequence[Axis], message: m.MotResumeEndOfMoveMsgs | m.MotSuspendEndOfMoveMsgs
) -> None:
    """Send a message to each place once."""
    for axis in {axis.place.address: axis for axis in axes}.values():
        axis.send(message)

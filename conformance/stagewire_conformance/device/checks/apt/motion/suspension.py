"""``suspend``: suspended end messages are not sent, and are sent again when resumed (pages 82 and 83)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import DELIVERY, EFFECT, SHARED, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.arrival import judge_place
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    ENDS,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.judgement import judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    absolute,
    beyond,
    distances,
    move,
)
from stagewire_conformance.device.checks.apt.motion.watch import watch
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS: Final = 0.25
"""The approximate duration of the move in seconds."""
_AFTER: Final = 0.2
"""Seconds after the end of a motion in which an end message would arrive."""
_BEFORE_STOP: Final = 0.12
"""Seconds after the beginning of a move in which it is stopped."""


KIND = Kind(
    name="suspend",
    title="End-of-move messages can be suspended and resumed",
    rules=(
        "end-messages-suspended",
        "end-messages-resumed",
        "slot-addressed-by-destination",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "End-of-move messages of {motors} can be suspended and resumed",
    messages=(
        "MOT_SUSPEND_ENDOFMOVEMSGS",
        "MOT_RESUME_ENDOFMOVEMSGS",
        "MOT_MOVE_ABSOLUTE",
        "MOT_MOVE_STOP",
        COMPLETED,
    ),
    does="moves all motors together within {range} while their end-of-move messages are suspended, stops "
    "them on their way back, and moves them on after the messages are resumed",
    seconds=2.3,
)
def _suspend_and_resume(axes: Sequence[Axis]) -> None:
    trial = axes[0].trial
    ways = distances(axes, _SECONDS)

    def arrived(axis: Axis, status: Status) -> bool:
        missed = status.position - axis.start - ways[axis]
        return not status.moving and abs(missed) <= axis.tolerance(ways[axis])

    targets = _one_of_each_target(axes)
    suspend(targets[:1])
    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(m.MotMoveAbsolute(axis.channel, axis.start + way))
    strays = beyond({axis: axis.start for axis in axes}, ways)
    seen = watch(axes, limits, done=arrived, strays=strays)
    late = trial.line.listen(_AFTER)
    for axis, way in ways.items():
        target = axis.start + way
        told = f"MOT_MOVE_ABSOLUTE to {target} with suspended end-of-move messages"
        mine = [
            each
            for each in late
            if each.source == axis.place.address and each.channel == axis.channel
        ]
        came = [*seen[axis].ends, *mine]
        if axis.place != axes[0].place:
            trial.must(
                bool(came),
                f"MOT_SUSPEND_ENDOFMOVEMSGS was sent to {axes[0].place.name}, but {axis.text} also sent no "
                f"{COMPLETED} after MOT_MOVE_ABSOLUTE to {target}; its messages are not suspended",
                rule="slot-addressed-by-destination",
                cause=Cause("MOT_SUSPEND_ENDOFMOVEMSGS", SHARED),
                because=(Cause(COMPLETED, DELIVERY),),
            )
            continue
        trial.must(
            not came,
            f"{axis.text}: after {told}, it sent "
            f"{', '.join(each.name or each.text for each in came)}; it should send nothing",
            rule="end-messages-suspended",
            cause=Cause("MOT_SUSPEND_ENDOFMOVEMSGS", EFFECT),
            because=unstopped(trial.declared),
            came=raw_of(came),
        )
        if not judge_place(axis, told, judge_rest(axis, told), axis.start, target):
            axis.halt()
    suspend(targets[1:])
    _stop_suspended(axes)
    _resume(axes)
    about = " after end-of-move messages were resumed"
    back = [absolute(axis, axis.start, about) for axis in axes]
    move([replace(each, rule="end-messages-resumed") for each in back])


def _stop_suspended(axes: Sequence[Axis]) -> None:
    """Start the way back and stop it: this must not be reported either."""
    for axis in axes:
        axis.send(absolute(axis, axis.start).message)
    axes[0].pause(_BEFORE_STOP)
    for axis in axes:
        axis.send(m.MotMoveStop(axis.channel, StopMode.PROFILED))
    for axis in axes:
        axis.standing()
    judge_silence(axes, "MOT_MOVE_STOP")


def suspend(axes: Sequence[Axis]) -> None:
    """Suspend the end messages of motors until the end of the check."""
    for axis in axes[:1]:
        axis.trial.undo("resumed end-of-move messages", lambda: _resume(axes))
    for axis in _one_of_each_target(axes):
        axis.send(m.MotSuspendEndOfMoveMsgs())


def _resume(axes: Sequence[Axis]) -> None:
    for axis in _one_of_each_target(axes):
        axis.send(m.MotResumeEndOfMoveMsgs())


def _one_of_each_target(axes: Sequence[Axis]) -> list[Axis]:
    return list({axis.place.address: axis for axis in axes}.values())


def judge_silence(axes: Sequence[Axis], command: str, earlier: Iterable[Incoming] = ()) -> None:
    """Report end messages that came after a command although they are suspended.

    :param earlier: the end messages that have already been received.
    """
    trial = axes[0].trial
    came = [*earlier, *(heard for heard in trial.line.listen(_AFTER) if heard.name in ENDS)]
    trial.must(
        not came,
        f"after {command} with suspended end-of-move messages, {axes[0].place.name} sent "
        f"{', '.join(heard.name for heard in came)}; it should send nothing",
        rule="end-messages-suspended",
        cause=Cause("MOT_SUSPEND_ENDOFMOVEMSGS", EFFECT),
        came=raw_of(came),
    )

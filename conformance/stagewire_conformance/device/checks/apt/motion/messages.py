"""Unsolicited messages about a motion: its end, and its status.

- ``suspend``: suspended end messages do not come, and come again when resumed (pages 82 and 83).
- ``move-updates``: periodic status messages follow a motion (pages 11 and 20).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import DELIVERY, EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import (
    ENDS,
    HELD,
    JITTER,
    POLL,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.judgement import judge_place, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    absolute,
    beyond,
    distances,
    move,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting
from stagewire_conformance.device.checks.apt.motion.watch import watch
from stagewire_conformance.device.checks.apt.streams import Stream, stream_of
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS_SUSPENDED: Final = 0.25
_AFTER: Final = 0.2
"""Seconds after the end of a move in which an end message would arrive."""
_BEFORE_STOP: Final = 0.12
"""Seconds after the beginning of a move in which it is stopped."""


SUSPEND = Kind(
    name="suspend",
    title="End-of-move messages can be suspended and resumed",
    rules=("end-messages-suspended", "end-messages-resumed", *MOTION_BITS),
)


@motor_check(
    SUSPEND,
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
    ways = distances(axes, _SECONDS_SUSPENDED)

    def arrived(axis: Axis, status: Status) -> bool:
        missed = status.position - axis.start - ways[axis]
        return not status.moving and abs(missed) <= axis.tolerance(ways[axis])

    trial.undo("resumed end-of-move messages", lambda: _tell(axes, m.MotResumeEndOfMoveMsgs()))
    _tell(axes, m.MotSuspendEndOfMoveMsgs())
    limits = {axis: axis.pace.bound(way) for axis, way in ways.items()}
    for axis, way in ways.items():
        axis.send(m.MotMoveAbsolute(axis.channel, axis.start + way))
    strays = beyond({axis: axis.start for axis in axes}, ways)
    seen = watch(axes, limits, done=arrived, strays=strays)
    behind = trial.line.listen(_AFTER)
    for axis, way in ways.items():
        target = axis.start + way
        told = f"MOT_MOVE_ABSOLUTE to {target} with suspended end-of-move messages"
        mine = [
            each
            for each in behind
            if each.source == axis.place.address and each.channel == axis.channel
        ]
        came = [*seen[axis].ends, *mine]
        trial.must(
            not came,
            f"{axis.text}: after {told}, it sent "
            f"{', '.join(each.name or each.text for each in came)}; it should send nothing",
            rule="end-messages-suspended",
            cause=Cause("MOT_SUSPEND_ENDOFMOVEMSGS", EFFECT),
            came=raw_of(came),
        )
        if not judge_place(axis, told, judge_rest(axis, told), axis.start, target):
            axis.halt()
    _stop_suspended(axes)
    _tell(axes, m.MotResumeEndOfMoveMsgs())
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
    came = [heard for heard in axes[0].trial.line.listen(_AFTER) if heard.name in ENDS]
    axes[0].trial.must(
        not came,
        f"after MOT_MOVE_STOP with suspended end-of-move messages, {axes[0].place.name} sent "
        f"{', '.join(heard.name for heard in came)}; it should send nothing",
        rule="end-messages-suspended",
        cause=Cause("MOT_SUSPEND_ENDOFMOVEMSGS", "MOT_MOVE_STOPPED"),
        came=raw_of(came),
    )


def _tell(
    axes: Sequence[Axis], message: m.MotResumeEndOfMoveMsgs | m.MotSuspendEndOfMoveMsgs
) -> None:
    """Send a message to each target once."""
    for axis in {axis.place.address: axis for axis in axes}.values():
        axis.send(message)


_SECONDS: Final = 0.6
_LONG: Final = 0.5
"""Seconds within which at least one periodic status message comes."""
_AT_REST: Final = 0.25
"""Seconds of status messages before the motion."""
_GIVEN_UP: Final = 5.0
"""Seconds after which a move is given up."""
_TWO: Final = 2
"""Messages of a moving motor of which the last one cannot come from the instant of the start."""
_FRESH: Final = 0.5
"""Seconds within which a status message from after the end of a move arrives."""


UPDATES = Kind(
    name="move-updates",
    title="Periodic status messages follow a motion",
    rules=(
        "updates-content",
        "updates-until-stop",
        "status-updates-position",
        "status-position",
        "dc-status-position",
        *MOTION_BITS,
    ),
)


@motor_check(
    UPDATES,
    "Periodic status messages of {motors} follow their motion",
    messages=("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range} and back while status messages are running",
    seconds=2.6,
)
def _follow_motion(axes: Sequence[Axis]) -> None:
    trial = axes[0].trial
    ways = distances_lasting(axes, _SECONDS)
    streams: dict[Axis, Stream] = {}
    for axis in axes:
        stream = stream_of(trial.declared, axis.place)
        assert stream is not None  # every motor has status messages
        streams[axis] = stream
    for stream in {axis.place.address: stream for axis, stream in streams.items()}.values():
        stream.begin(trial)
    trial.line.listen(_AT_REST)
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    began = trial.line.now
    heard = _listen_to_motion(axes, began)
    for axis in axes:
        end = next(
            (each for each in heard if each.name in ENDS and each.channel == axis.channel), None
        )
        seconds = (end.time if end else trial.line.now) - began
        last = _fresh(axis, streams[axis])
        trial.must(
            last is not None,
            f"{axis.text} sent no periodic {streams[axis].status} within {_FRESH} s of the "
            "end of a move",
            rule="updates-content",
            cause=Cause(streams[axis].status, DELIVERY),
        )
        if last is not None:
            came = [each for each in heard if _is_of(axis, streams[axis], each)]
            came = [each for each in came if each.time <= began + seconds]
            _judge_updates(axis, [axis.status_of(each) for each in came], last)
            trial.must(
                bool(came) or seconds < _LONG,
                f"{axis.text} sent no periodic {streams[axis].status} during a move of {seconds:.2f} s, "
                "but again after it; status messages should continue",
                rule="updates-until-stop",
                cause=Cause(streams[axis].status, "periodic"),
            )


def _listen_to_motion(axes: Sequence[Axis], began: float) -> list[Incoming]:
    """Return everything received until all motors have reported their ends. Nothing is requested meanwhile.

    Motors that are given up, or leave their range, are stopped.
    """
    line = axes[0].trial.line
    heard: list[Incoming] = []
    latest = began + _GIVEN_UP
    while line.now < latest:
        new = line.listen(POLL)
        heard += new
        if sum(each.name in ENDS for each in heard) >= len(axes):
            return heard
        places = [getattr(each.message, "position", None) for each in new]
        low, high = min(axis.low for axis in axes), max(axis.high for axis in axes)
        if any(place is not None and not low - HELD <= place <= high + HELD for place in places):
            break
    for axis in axes:
        axis.halt()
    return heard


def _fresh(axis: Axis, stream: Stream) -> Status | None:
    """Return the next periodic status. Messages that are already waiting are older."""
    line = axis.trial.line
    kept = line.listen(0)
    came = line.listen(_FRESH, until=lambda heard: _is_of(axis, stream, heard))
    line.heard[:0] = [*kept, *came]
    mine = [each for each in came if _is_of(axis, stream, each)]
    return axis.status_of(mine[-1]) if mine else None


def _is_of(axis: Axis, stream: Stream, heard: Incoming) -> bool:
    return bool(stream.of_it([heard])) and heard.channel == axis.channel


def _judge_updates(axis: Axis, came: Sequence[Status], last: Status) -> None:
    asked = axis.status()
    axis.trial.must(
        abs(last.position - asked.position) <= HELD and last.moving == asked.moving,
        f"{axis.text}: after a move, the periodic {last.heard.name} reports {last.heard.text}, "
        f"but the requested one reports {asked.heard.text}",
        rule="updates-content",
        cause=Cause(last.heard.name, "periodic"),
        came=last.heard.raw,
    )
    if not came:
        return
    axis.trial.must(
        any(status.moving or status.position != axis.start for status in came),
        f"{axis.text}: during a move, all {len(came)} periodic {last.heard.name} reported no "
        f"motion at {axis.start}",
        rule="status-updates-position",
        cause=Cause(last.heard.name, "periodic"),
        came=came[-1].heard.raw,
    )
    moving = [status for status in came if status.moving]
    axis.trial.must(
        len(moving) < _TWO or abs(moving[-1].position - axis.start) > JITTER,
        f"{axis.text}: during a move, {len(moving)} periodic {last.heard.name} reported motion, but all "
        f"at {axis.start}, where it began; the position should follow the motion",
        rule="status-updates-position",
        cause=Cause(last.heard.name, "periodic"),
        came=moving[-1].heard.raw if moving else None,
    )

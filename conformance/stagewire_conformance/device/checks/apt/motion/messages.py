"""Messages that come by themselves because of a motion: its end, and its status.

- ``suspend``: end messages that are suspended do not come, and come again when resumed (pages 82 and 83).
- ``move-updates``: status messages that come by themselves follow a motion (pages 11 and 20).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.judgement import judge_place, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    absolute,
    distances,
    move,
)
from stagewire_conformance.device.checks.apt.motion.watch import watch
from stagewire_conformance.device.checks.apt.streams import Stream, stream_of
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS_SUSPENDED: Final = 0.25
_AFTER: Final = 0.2
"""Seconds in which an end message would come behind the end of a move."""


SUSPEND = Kind(
    name="suspend",
    title="End messages can be suspended and resumed",
    rules=("end-messages-suspended", "end-messages-resumed"),
)


@motor_check(
    SUSPEND,
    "End messages of {motors} can be suspended and resumed",
    messages=(
        "MOT_SUSPEND_ENDOFMOVEMSGS",
        "MOT_RESUME_ENDOFMOVEMSGS",
        "MOT_MOVE_ABSOLUTE",
        COMPLETED,
    ),
    does="moves all motors at once within {range} while their end messages are suspended, and back when they "
    "are resumed",
)
def _suspend_and_resume(axes: Sequence[Axis]) -> None:
    trial = axes[0].trial
    ways = distances(axes, _SECONDS_SUSPENDED)

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


_SECONDS: Final = 0.4
_FRESH: Final = 0.5
"""Seconds in which a status message comes that was made after the end of a move."""


UPDATES = Kind(
    name="move-updates",
    title="Status messages that come by themselves follow a motion",
    rules=(
        "updates-content",
        "status-updates-position",
        "status-position",
        "dc-status-position",
        *MOTION_BITS,
    ),
)


@motor_check(
    UPDATES,
    "Status messages of {motors} that come by themselves follow their motion",
    messages=("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors at once within {range} while status messages come, and back",
)
def _follow_motion(axes: Sequence[Axis]) -> None:
    trial = axes[0].trial
    streams: dict[Axis, Stream] = {}
    for axis in axes:
        stream = stream_of(trial.declared, axis.place)
        assert stream is not None  # every motor has status messages
        streams[axis] = stream
    for stream in {axis.place.address: stream for axis, stream in streams.items()}.values():
        stream.begin(trial)
    ways = distances(axes, _SECONDS)
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    seen = watch(axes, {axis: axis.pace.limit(way) for axis, way in ways.items()})
    for axis in axes:
        last = _fresh(axis, streams[axis])
        trial.must(
            last is not None,
            f"{axis.text}: no {streams[axis].status} came by itself within {_FRESH} s of the end of a move",
        )
        if last is not None:
            came = [each for each in seen[axis].others if _is_of(axis, streams[axis], each)]
            _judge_updates(axis, [axis.status_of(each) for each in came], last)


def _fresh(axis: Axis, stream: Stream) -> Status | None:
    """Return what comes by itself from now on; what is waiting is older."""
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
        f"{axis.text}: after a move {last.heard.name} that comes by itself says {last.heard.text}; "
        f"asked for, it says {asked.heard.text}",
        came=last.heard.raw,
    )
    axis.trial.must(
        not came or any(status.moving or status.position != axis.start for status in came),
        f"{axis.text}: while it moved, {len(came)} times {last.heard.name} came and said that it stood at "
        f"{axis.start}",
        came=came[-1].heard.raw if came else None,
    )

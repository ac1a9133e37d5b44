"""``move-updates``: status messages that come by themselves follow a motion (pages 11 and 20)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import COMPLETED, absolute, distances
from stagewire_conformance.device.checks.apt.motion.rules import MOTION_BITS
from stagewire_conformance.device.checks.apt.motion.watching import watch
from stagewire_conformance.device.checks.apt.streams import Stream, stream_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming


_SECONDS: Final = 0.4
_FRESH: Final = 0.5
"""Seconds in which a status message comes that was made after the end of a move."""


KIND = Kind(
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
    KIND,
    "Status messages of {} that come by themselves follow their motion",
    messages=("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors at once within {} while status messages come, and back",
)
def _run(axes: Sequence[Axis]) -> None:
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
            _judge(axis, [axis.status_of(each) for each in came], last)


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


def _judge(axis: Axis, came: Sequence[Status], last: Status) -> None:
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

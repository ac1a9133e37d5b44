"""``move-updates``: periodic status messages follow a motion, and stop during one (pages 11 and 20)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import DELIVERY, ENDED, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import (
    COMPLETED,
    ENDS,
    HELD,
    JITTER,
    POLL,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    absolute,
)
from stagewire_conformance.device.checks.apt.motion.shuttle import distances_lasting
from stagewire_conformance.device.checks.apt.streams import LATE, Stream, judge_ended, stream_of
from stagewire_conformance.device.lines.line import jitter_of
from stagewire_conformance.device.results import Result

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_SECONDS: Final = 0.8
"""The approximate duration of the move in seconds."""
_ALONE: Final = 0.35
"""Seconds of the way back in which status messages must follow the motion without requests."""
_LONG: Final = 0.5
"""Seconds within which at least one periodic status message arrives."""
_SLOW: Final = 2.0
"""The same seconds if the rate is known to be lower than usual, which is a departure only."""
_AT_REST: Final = 0.25
"""Seconds of status messages before the motion."""
_GIVEN_UP: Final = 5.0
"""Seconds after which a move is stopped."""
_FOLLOWS: Final = 2
"""The number of statuses of a moving motor after which the position must have changed."""
_TELLING: Final = 20
"""A motor is on its way while it covers at least a twentieth of the distance in a period."""
_FRESH: Final = 0.5
"""Seconds within which a status message from after the end of a move arrives."""


KIND = Kind(
    name="move-updates",
    title="Periodic status messages follow a motion",
    rules=(
        "updates-content",
        "updates-until-stop",
        "updates-stop",
        "status-updates-position",
        "status-position",
        "dc-status-position",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "Periodic status messages of {motors} follow their motion",
    messages=("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "MOT_MOVE_ABSOLUTE", COMPLETED),
    does="moves all motors together within {range} while status messages are running, requests the status "
    "meanwhile, moves the motors back without requests, and stops the messages on the way",
    seconds=2.9,
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
    last = {axis: axis.status() for axis in axes}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    began = trial.line.now
    pairs: dict[Axis, list[_Pair]] = {axis: [] for axis in axes}

    def ask(heard: Sequence[Incoming]) -> None:
        """Request the status after a periodic one, to see how old its position is."""
        for axis in axes:
            if came := [each for each in heard if _is_of(axis, streams[axis], each)]:
                asked = axis.status()
                pairs[axis].append(_Pair(last[axis], axis.status_of(came[-1]), asked))
                last[axis] = asked

    heard = _listen_to_motion(axes, began, ask)
    for axis in axes:
        end = next(
            (each for each in heard if each.name in ENDS and each.channel == axis.channel), None
        )
        seconds = (end.time if end else trial.line.now) - began
        _judge_stream(axis, streams[axis], heard, began, seconds)
        _judge_age(axis, pairs[axis], ways[axis])
    if trial.result is Result.PASS:
        _follow_back(axes, streams)


def _judge_stream(
    axis: Axis, stream: Stream, heard: Sequence[Incoming], began: float, seconds: float
) -> None:
    """Judge whether status messages came during a move of some seconds, and the one after it."""
    is_slow = bool(axis.trial.causes.check_of(Cause(stream.status, "rate")))
    wait = _SLOW if is_slow else _FRESH
    last = _fresh(axis, stream, wait)
    if not axis.trial.must(
        last is not None,
        f"{axis.text} sent no periodic {stream.status} within {wait:g} s of the end of a move",
        rule="updates-until-stop",
        cause=Cause(stream.status, DELIVERY),
        because=(Cause(stream.status, ENDED),),
    ):
        return
    assert last is not None
    came = [each for each in heard if _is_of(axis, stream, each)]
    came = [each for each in came if each.time <= began + seconds]
    _judge_last(axis, last)
    _judge_positions(axis, [axis.status_of(each) for each in came], axis.start)
    axis.trial.must(
        bool(came) or seconds < (_SLOW if is_slow else _LONG),
        f"{axis.text} sent no periodic {stream.status} during a move of {seconds:.2f} s, "
        "but again after it; status messages should continue",
        rule="updates-until-stop",
        cause=Cause(stream.status, "periodic"),
    )


def _follow_back(axes: Sequence[Axis], streams: Mapping[Axis, Stream]) -> None:
    """Move the motors back, request nothing, and stop their status messages meanwhile."""
    line = axes[0].trial.line
    targets = {stream.place.address: stream for stream in streams.values()}
    begins = {axis: axis.status().position for axis in axes}
    line.listen(0)
    for axis in axes:
        axis.send(absolute(axis, axis.start).message)
    began = line.now
    heard = line.listen(_ALONE)
    for axis in axes:
        came = [axis.status_of(each) for each in heard if _is_of(axis, streams[axis], each)]
        _judge_positions(axis, came, begins[axis])
    line.heard[:0] = [each for each in heard if each.name in ENDS]
    for stream in targets.values():
        stream.end(axes[0].trial)
    line.pause(LATE)
    line.heard[:] = [each for each in line.heard if each.name in ENDS]
    heard = _listen_to_motion(axes, began)
    for stream in targets.values():
        judge_ended(axes[0].trial, stream, heard, " during a move")


@dataclass(frozen=True)
class _Pair:
    """A periodic status, with the requested ones before and after it."""

    before: Status
    update: Status
    after: Status

    @property
    def age(self) -> float:
        """The seconds since the motor was at the position of the periodic status."""
        gone = self.after.position - self.before.position
        seconds = self.after.time - self.before.time
        since = (self.after.position - self.update.position) / gone * seconds
        return since - (self.after.time - self.update.time)


def _judge_age(axis: Axis, pairs: Sequence[_Pair], way: int) -> None:
    """Report periodic statuses whose positions are all half a period old, or older."""
    telling = max(HELD, abs(way) // _TELLING)
    moving = [pair for pair in pairs if abs(pair.after.position - pair.before.position) >= telling]
    if len(moving) < _FOLLOWS:
        return
    period = min(pair.after.time - pair.before.time for pair in moving)
    age = min(pair.age for pair in moving)
    if jitter_of(axis.trial.line).blurs(period / 2):
        return
    axis.trial.must(
        age < period / 2,
        f"{axis.text}: during a move, the positions of all {len(moving)} periodic "
        f"{moving[0].update.heard.name} were at least {age * 1e3:.0f} ms old, compared with requested ones; "
        "each should report the current position",
        rule="status-updates-position",
        cause=Cause(moving[0].update.heard.name, "periodic"),
        because=axis.spoilt,
        came=moving[0].update.heard.raw,
    )


def _listen_to_motion(
    axes: Sequence[Axis],
    began: float,
    look: Callable[[Sequence[Incoming]], None] = lambda heard: None,
) -> list[Incoming]:
    """Return everything received until all motors have reported their ends.

    Motors that take too long or leave their range are stopped.

    :param look: called with what has arrived.
    """
    line = axes[0].trial.line
    heard: list[Incoming] = []
    latest = began + _GIVEN_UP
    while line.now < latest:
        new = line.listen(POLL)
        heard += new
        look(new)
        if sum(each.name in ENDS for each in heard) >= len(axes):
            return heard
        places = [getattr(each.message, "position", None) for each in new]
        low, high = min(axis.low for axis in axes), max(axis.high for axis in axes)
        if any(place is not None and not low - HELD <= place <= high + HELD for place in places):
            break
    for axis in axes:
        axis.halt()
    return heard


def _fresh(axis: Axis, stream: Stream, wait: float) -> Status | None:
    """Return the next periodic status. Messages that are already waiting are older."""
    line = axis.trial.line
    kept = line.listen(0)
    came = line.listen(wait, until=lambda heard: _is_of(axis, stream, heard))
    line.heard[:0] = [*kept, *came]
    mine = [each for each in came if _is_of(axis, stream, each)]
    return axis.status_of(mine[-1]) if mine else None


def _is_of(axis: Axis, stream: Stream, heard: Incoming) -> bool:
    return bool(stream.of_it([heard])) and heard.channel == axis.channel


def _judge_last(axis: Axis, last: Status) -> None:
    """Compare the periodic status after a move with a requested one."""
    asked = axis.status()
    axis.trial.must(
        abs(last.position - asked.position) <= HELD and last.moving == asked.moving,
        f"{axis.text}: after a move, the periodic {last.heard.name} reports {last.heard.text}, "
        f"but the requested one reports {asked.heard.text}",
        rule="updates-content",
        cause=Cause(last.heard.name, "periodic"),
        came=last.heard.raw,
    )


def _judge_positions(axis: Axis, came: Sequence[Status], begin: int) -> None:
    """Report periodic statuses that do not follow a motion.

    :param begin: the position at which it began.
    """
    axis.trial.must(
        len(came) < _FOLLOWS or any(status.moving or status.position != begin for status in came),
        f"{axis.text}: during a move, all {len(came)} periodic {came[0].heard.name if came else ''} reported "
        f"no motion at {begin}",
        rule="status-updates-position",
        cause=Cause(came[-1].heard.name, "periodic") if came else None,
        because=axis.doubts,
        came=came[-1].heard.raw if came else None,
    )
    moving = [status for status in came if status.moving]
    axis.trial.must(
        len(moving) < _FOLLOWS or abs(moving[-1].position - begin) > JITTER,
        f"{axis.text}: during a move, {len(moving)} periodic {moving[0].heard.name if moving else ''} "
        f"reported motion, but all at {begin}, where it began; the position should follow the motion",
        rule="status-updates-position",
        cause=Cause(moving[0].heard.name, "periodic") if moving else None,
        came=moving[-1].heard.raw if moving else None,
    )

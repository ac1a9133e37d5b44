"""``move-updates``: periodic status messages follow a motion, and stop during one (pages 11 and 20)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

_SECONDS: Final = 0.6
"""The approximate duration of the move in seconds."""
_BEGUN: Final = 0.1
"""Seconds after the command in which the move back begins."""
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
    does="moves all motors together within {range} and back while status messages are running, requests "
    "the status on the way back, moves them again, and stops the messages meanwhile",
    seconds=3.6,
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
        is_slow = bool(trial.causes.check_of(Cause(streams[axis].status, "rate")))
        wait = _SLOW if is_slow else _FRESH
        last = _fresh(axis, streams[axis], wait)
        trial.must(
            last is not None,
            f"{axis.text} sent no periodic {streams[axis].status} within {wait:g} s of the "
            "end of a move",
            rule="updates-content",
            cause=Cause(streams[axis].status, DELIVERY),
            because=(Cause(streams[axis].status, ENDED),),
        )
        if last is not None:
            came = [each for each in heard if _is_of(axis, streams[axis], each)]
            came = [each for each in came if each.time <= began + seconds]
            _judge_updates(axis, [axis.status_of(each) for each in came], last)
            trial.must(
                bool(came) or seconds < (_SLOW if is_slow else _LONG),
                f"{axis.text} sent no periodic {streams[axis].status} during a move of {seconds:.2f} s, "
                "but again after it; status messages should continue",
                rule="updates-until-stop",
                cause=Cause(streams[axis].status, "periodic"),
            )
    if trial.result is Result.PASS:
        _follow_back(axes, streams)
    if trial.result is Result.PASS:
        _stop_on_the_way(ways, streams)


def _follow_back(axes: Sequence[Axis], streams: Mapping[Axis, Stream]) -> None:
    """Move back, and request the status after each periodic one, to see how old its position is."""
    line = axes[0].trial.line
    pairs: dict[Axis, list[_Pair]] = {axis: [] for axis in axes}
    last = {axis: axis.status() for axis in axes}
    way = {axis: axis.start - last[axis].position for axis in axes}
    for axis in axes:
        axis.send(absolute(axis, axis.start).message)

    def is_update(axis: Axis, heard: Incoming) -> bool:
        return _is_of(axis, streams[axis], heard)

    latest = line.now + _GIVEN_UP
    ended = 0
    while ended < len(axes) and line.now < latest:
        heard = line.listen(
            POLL, until=lambda one: one.name in ENDS or any(is_update(axis, one) for axis in axes)
        )
        ended += sum(each.name in ENDS for each in heard)
        for axis in axes:
            if came := [each for each in heard if is_update(axis, each)]:
                asked = axis.status()
                pairs[axis].append(_Pair(last[axis], axis.status_of(came[-1]), asked))
                last[axis] = asked
    if ended < len(axes):
        for axis in axes:
            axis.halt()
    for axis in axes:
        _judge_age(axis, pairs[axis], way[axis])


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


def _stop_on_the_way(ways: Mapping[Axis, int], streams: Mapping[Axis, Stream]) -> None:
    """Move the motors again, and stop their status messages meanwhile."""
    axes = list(ways)
    line = axes[0].trial.line
    targets = {stream.place.address: stream for stream in streams.values()}
    for axis, way in ways.items():
        axis.send(absolute(axis, axis.start + way).message)
    began = line.now
    line.pause(_BEGUN)
    for stream in targets.values():
        stream.end(axes[0].trial)
    line.pause(LATE)
    line.heard[:] = [heard for heard in line.heard if heard.name in ENDS]
    heard = _listen_to_motion(axes, began)
    for stream in targets.values():
        judge_ended(axes[0].trial, stream, heard, " during a move")


def _listen_to_motion(axes: Sequence[Axis], began: float) -> list[Incoming]:
    """Return everything received until all motors have reported their ends. Nothing is requested meanwhile.

    Motors that take too long or leave their range are stopped.
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
        len(moving) < _FOLLOWS or abs(moving[-1].position - axis.start) > JITTER,
        f"{axis.text}: during a move, {len(moving)} periodic {last.heard.name} reported motion, but all "
        f"at {axis.start}, where it began; the position should follow the motion",
        rule="status-updates-position",
        cause=Cause(last.heard.name, "periodic"),
        came=moving[-1].heard.raw if moving else None,
    )

"""``home``: motors home, say so once, and count from there (pages 28 and 41).

It comes first of what moves: only a motor that was homed knows where it is. A range has to include 0, which
is home; on its way a motor may leave the range as far as its switch, or its index mark, makes it. Afterwards
it goes back to where it stood. Where it was not homed before, its positions from then on are others.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, Status
from stagewire_conformance.device.checks.apt.motion.judgement import judge_end, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import (
    APART,
    MOTION_BITS,
    motor_check,
)
from stagewire_conformance.device.checks.apt.motion.watch import Watched, watch

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.motion.motor_check import Motor
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions


_HOMED: Final = "MOT_MOVE_HOMED"
_STOPPED: Final = "MOT_MOVE_STOPPED"
_LIMIT: Final = 180.0
"""Seconds after which homing is given up while the motor still moves."""
_NEAR: Final = 64
"""Counts within which a servo holds its stage."""
_MOVES: Final = 8
"""Counts by which a motor has moved between two looks at it, if they are more."""
_LATE: Final = 0.1
"""Seconds after the first look in which the bit may still be missing."""
_LOOKS: Final = 3
"""Looks at a motor on its way home before it is stopped."""
_HOME: Final = "MOT_MOVE_HOME"


def _lacks(declared: Declaration, allowed: Permissions, motor: Motor) -> str:
    place, channel = motor
    if not place.connected_to(channel).homes:
        return f"the PICS says that channel {channel} of {place.name} does not home"
    if allowed.motion is None:
        return ""
    low, high = declared.reach(place, channel, allowed.motion)
    if low <= 0 <= high:
        return ""
    return f"homing goes to 0: allow a range that includes it, not {allowed.motion}"


KIND = Kind(
    name="home",
    title="A motor homes, says so once, and counts from there",
    rules=(
        "home-starts",
        "home-no-response",
        "home-completed",
        "position-after-homing",
        "position-counter-absolute",
        "encoder-counter-after-homing",
        "stop-any-move",
        *MOTION_BITS,
        *APART,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_HOME homes {motors}, and the end is reported once",
    messages=("MOT_MOVE_HOME", _HOMED, "MOT_MOVE_STOP", _STOPPED),
    does="homes all motors at once, stopping each on its way first: each runs to its switch or "
    "index mark wherever that is, counts from there as 0, and goes back to where it stood",
    seconds=10.0,
    lacks=_lacks,
    also=("MOT_REQ_POSCOUNTER", "MOT_GET_POSCOUNTER"),
)
def _home(axes: Sequence[Axis]) -> None:
    safe = []
    for axis in axes:
        if why := _unsafe(axis):
            axis.trial.inconclusive(f"{axis.text} was not homed: {why}")
        else:
            safe.append(axis)
    if not safe:
        return
    before = {axis: axis.status() for axis in safe}
    _stop_homing(safe)
    for axis in safe:
        axis.send(m.MotMoveHome(axis.channel))
    seen = watch(safe, dict.fromkeys(safe, _LIMIT), strays=None)
    for axis in safe:
        _judge(axis, before[axis], seen[axis])


def _stop_homing(axes: Sequence[Axis]) -> None:
    """Begin to home, stop it on the way, and judge what comes; one that is at home already has no way."""
    began = {axis: axis.status().position for axis in axes}
    looks = dict.fromkeys(axes, 0)

    def on_its_way(axis: Axis, status: Status) -> bool:
        looks[axis] += 1
        return looks[axis] >= _LOOKS and abs(status.position - began[axis]) > _MOVES

    for axis in axes:
        axis.send(m.MotMoveHome(axis.channel))
    seen = watch(axes, dict.fromkeys(axes, _LIMIT), stop=on_its_way, strays=None)
    for axis in axes:
        each = seen[axis]
        _judge_way(axis, each.statuses)
        was_over = [end.name for end in each.ends] == [_HOMED, _STOPPED]
        if each.stopped is None or was_over:
            continue
        told = "MOT_MOVE_STOP in MOT_MOVE_HOME"
        end = judge_end(axis, told, each, _STOPPED)
        if end is not None:
            judge_rest(axis, told, end)


def _judge(axis: Axis, before: Status, seen: Watched) -> None:
    end = judge_end(axis, _HOME, seen, _HOMED)
    _judge_way(axis, seen.statuses)
    status = judge_rest(axis, _HOME)
    axis.start = _way_back(axis, before, seen.statuses, status)
    if end is None or end.name != _HOMED:
        return
    axis.trial.must(
        status.bits.homed,
        f"{axis.text}: {_HOMED} came, and {status.heard.name} does not say homed",
        came=status.heard.raw,
    )
    axis.trial.must(
        abs(status.position) <= _NEAR,
        f"{axis.text}: {_HOMED} came, and the position is {status.position}; it should count from home, 0",
        came=status.heard.raw,
    )
    if "MOT_REQ_POSCOUNTER" in axis.place.messages:
        counter = axis.ask(m.MotReqPosCounter(axis.channel))
        position: int = counter.message.position
        axis.trial.must(
            abs(position - status.position) <= _NEAR,
            f"{axis.text}: after homing MOT_GET_POSCOUNTER said {position}, and {status.heard.name} "
            f"{status.position}; the counter should show the actual position",
            came=counter.raw,
        )


def _unsafe(axis: Axis) -> str:
    """Return why it might run into an end without stopping; empty where it should not.

    Home parameters of zero have driven stages into their ends. Stages of brushless controllers, which have no
    parameters of limit switches, ignore them (pages 37 and 39).
    """
    place = axis.place
    if "MOT_REQ_HOMEPARAMS" not in place.messages or "MOT_SET_LIMSWITCHPARAMS" not in place.listed:
        return ""
    told = axis.ask(m.MotReqHomeParams(axis.channel)).message
    if told.limit_switch == 0:
        return "its home parameters name no limit switch, so it might run into its end"
    return ""


def _judge_way(axis: Axis, statuses: Sequence[Status]) -> None:
    shown = any(status.bits.homing for status in statuses)
    for earlier, status in pairwise(statuses):
        if shown and earlier.time - statuses[0].time < _LATE:
            continue
        if abs(status.position - earlier.position) > _MOVES and not earlier.bits.homing:
            axis.trial.must(
                False,
                f"{axis.text}: on its way home, at {earlier.position}, {earlier.heard.name} does not say "
                "that it is homing",
                came=earlier.heard.raw,
            )
            return


def _way_back(axis: Axis, before: Status, way: Sequence[Status], now: Status) -> int:
    """Return where it stood, as it counts now; where that is not to be reached within the range, it stays."""
    stood = before.position
    if not before.bits.homed and way:
        stood += now.position - way[-1].position
    if axis.can_return_to(stood):
        return stood
    nearest = max(axis.low, min(now.position, axis.high))  # it may tremble at the end of the range
    return nearest if abs(now.position - nearest) <= _NEAR else now.position

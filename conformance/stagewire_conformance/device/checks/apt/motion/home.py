"""``home``: motors home, report it once, and count from home (pages 28 and 41).

This is the first check with motion: only a homed motor has a known position. The range must include 0, which
is home. On its way, a motor may leave the range, depending on where its switch or index mark is. Afterwards
it returns to its previous position. If it was not homed before, its positions change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_status
from stagewire_conformance.device.checks.apt.motion.apart import (
    judge_sources,
    judge_stop_alone,
    start,
)
from stagewire_conformance.device.checks.apt.motion.axis import HELD, HOMED, STOPPED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.early_ends import judge_over
from stagewire_conformance.device.checks.apt.motion.judgement import judge_end, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import (
    APART,
    MOTION_BITS,
    motor_check,
)
from stagewire_conformance.device.checks.apt.motion.pace import home_pace_of, velocity_scale
from stagewire_conformance.device.checks.apt.motion.speed_notes import note_speed
from stagewire_conformance.device.checks.apt.motion.stopping import judge_stopping
from stagewire_conformance.device.checks.apt.motion.watch import Decision, Watched, watch
from stagewire_conformance.device.trial import EnoughError, NotRunError

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.motion.motor_check import Motor
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions


_LONGEST: Final = 180.0
"""The most seconds that homing may take."""
_UNKNOWN: Final = 60.0
"""Seconds that homing may take if the travel or the scale of its velocity is unknown."""
_MOVES: Final = 8
"""Counts between two readings above which a motor has moved."""
_LATE: Final = 0.1
"""Seconds after the first reading in which the homing bit may be missing."""
_LOOKS: Final = 3
"""Readings of a motor on its way home before it is stopped."""
_APART: Final = 0.4
"""Seconds between the stops of two motors."""
_HOME: Final = "MOT_MOVE_HOME"


def lacks_home(declared: Declaration, allowed: Permissions, motor: Motor) -> str:
    """Return why a motor cannot be homed with these permissions; empty if it can."""
    place, channel = motor
    if not place.connected_to(channel).homes:
        return f"the PICS states that channel {channel} of {place.name} does not home"
    if allowed.motion is None:
        return ""
    low, high = declared.reach(place, channel, allowed.motion)
    if low <= 0 <= high:
        return ""
    return f"homing goes to 0; allow a range that includes it instead of {allowed.motion}"


KIND = Kind(
    name="home",
    title="A motor homes, reports the end once, and counts from the home position",
    rules=(
        "home-starts",
        "home-no-response",
        "home-completed",
        "position-after-homing",
        "position-counter-absolute",
        "encoder-counter-after-homing",
        "stop-any-move",
        "absolute-move",
        *MOTION_BITS,
        *APART,
    ),
)


@motor_check(
    KIND,
    "MOT_MOVE_HOME homes {motors}, and each reports the end once",
    messages=("MOT_MOVE_HOME", HOMED, "MOT_MOVE_STOP", STOPPED, "MOT_MOVE_ABSOLUTE"),
    does="starts homing all motors together, stops each once on its way, and homes them again: each "
    "runs to its switch or index mark, which may be outside the range, takes that position as 0, and "
    "returns to its previous position",
    bound=f"homing ends within {_LONGEST:g} s and after at most 1.1 times the travel, or is stopped; "
    f"without a declared travel within {_UNKNOWN:g} s",
    seconds=5.5,
    lacks=lacks_home,
)
def _home(axes: Sequence[Axis]) -> None:
    safe = []
    for axis in axes:
        if why := unsafe(axis):
            axis.trial.inconclusive(f"{axis.text} was not homed: {why}")
        else:
            safe.append(axis)
    if not safe:
        return
    before = {axis: axis.status() for axis in safe}
    bounds = {axis: homing_bound(axis) for axis in safe}
    limits = {axis: seconds for axis, (_, seconds) in bounds.items()}

    def strays(axis: Axis, status: Status) -> bool:
        return abs(status.position - before[axis].position) > bounds[axis][0]

    _stop_homing(safe, limits, strays)
    for axis in safe:
        axis.send(m.MotMoveHome(axis.channel))
    seen = watch(safe, limits, strays=strays, longest=_LONGEST)
    for axis in safe:
        if axis.pace.printed:
            homing = home_pace_of(axis.trial, axis.place, axis.channel, axis.pace)
            note_speed(axis, seen[axis].statuses, homing)
        if not _went_too_far(axis, seen[axis]):
            _judge(axis, before[axis], seen[axis], strays)


def _went_too_far(axis: Axis, seen: Watched) -> bool:
    """Return whether a motor was stopped on its way home because it had gone too far, and note it."""
    if seen.strayed is None:
        return False
    axis.trial.inconclusive(
        f"{axis.text}: MOT_MOVE_HOME was stopped at {seen.strayed.position}, because it had gone further "
        "than homing should need; if home is further away, declare the travel in the PICS"
    )
    return True


def homing_bound(axis: Axis) -> tuple[int, float]:
    """Return the most counts and seconds that homing may need; end the check if it would take longer.

    A position that is not yet counted from home does not show how far away home is. Without a declared travel
    the distance is that of the longest time at the home velocity.
    """
    travel, scale = axis.place.travel_of(axis.channel), velocity_scale(axis.place, axis.channel)
    velocity = axis.pace.velocity
    if "MOT_REQ_HOMEPARAMS" in axis.place.messages:
        told = axis.ask(m.MotReqHomeParams(axis.channel)).message.home_velocity
        velocity = told * axis.pace.unit or velocity  # one of 0 is judged when it homes
    if travel is None:
        fastest = velocity * axis.pace.fastest.unit / axis.pace.unit
        return int(fastest * _UNKNOWN) + HELD, _UNKNOWN
    length = travel.high - travel.low
    way = length + length // 10 + HELD
    needed = way / velocity
    if scale is None or (needed > _LONGEST and axis.pace.printed):
        return way, _UNKNOWN
    if needed > _LONGEST:
        raise NotRunError(
            f"homing over up to {way} counts may take {needed:.0f} s at {velocity:.0f} counts/s, but "
            f"the suite starts none that takes more than {_LONGEST:.0f} s; set a higher home velocity"
        )
    return way, min(_LONGEST, 2 * needed + 10)


def _stop_homing(axes: Sequence[Axis], limits: Mapping[Axis, float], strays: Decision) -> None:
    """Start homing, stop it on the way, and judge the messages.

    A motor that is already at home has no way to go.
    """
    before = {axis: axis.status() for axis in axes}
    looks = dict.fromkeys(axes, 0)
    stops: dict[Axis, float] = {}
    others: dict[Axis, list[Status]] = {axis: [] for axis in axes[1:]}  # after the first stop

    def on_its_way(axis: Axis, status: Status) -> bool:
        looks[axis] += 1
        if stops and axis not in stops:
            others[axis].append(status)
        going = looks[axis] >= _LOOKS and abs(status.position - before[axis].position) > _MOVES
        if stops:
            is_next = status.time - max(stops.values()) >= _APART
        else:  # the first one, unless it has already arrived
            is_next = axis is axes[0] or looks[axis] > looks[axes[0]] + 1
        if going and is_next:
            stops[axis] = status.time
        return going and is_next

    start({axis: m.MotMoveHome(axis.channel) for axis in axes}, first_alone=True)
    seen = watch(axes, limits, stop=on_its_way, strays=strays, longest=_LONGEST)
    if seen[axes[0]].stopped is not None:
        judge_stop_alone(axes[0], {axis: seen[axis] for axis in others}, others)
    judge_sources(seen)
    for axis in axes:
        each = seen[axis]
        if _went_too_far(axis, each):
            raise EnoughError
        _judge_way(axis, each.statuses)
        _judge_not_homed(axis, before[axis], each)
        was_over = [end.name for end in each.ends] == [HOMED, STOPPED]
        if each.stopped is None or (was_over and _is_home(axis, axis.status(), before[axis])):
            continue
        told = "MOT_MOVE_STOP in MOT_MOVE_HOME"
        if not judge_stopping(axis, told, before[axis].position, each, StopMode.PROFILED):
            continue
        end = judge_end(axis, told, each, STOPPED)
        if end is not None and judge_over(
            axis, told, end, each, strays=strays, ignored=partial(_is_home, before=before[axis])
        ):
            judge_rest(axis, told, end, each)


def _is_home(axis: Axis, status: Status, before: Status) -> bool:
    """Return whether a motor has gone home although it was stopped."""
    newly = status.bits.homed and not before.bits.homed
    return newly or (abs(status.position) <= HELD < abs(before.position))


def _judge_not_homed(axis: Axis, before: Status, seen: Watched) -> None:
    """Report a motor that reports homed, although homing was stopped and it was not homed before."""
    if before.bits.homed or [end.name for end in seen.ends] != [STOPPED]:
        return
    now = axis.status()
    axis.trial.must(
        not now.bits.homed or now.moving,
        f"{axis.text}: MOT_MOVE_STOP ended MOT_MOVE_HOME on its way, but {now.heard.name} reports homed",
        rule=rule_of_status(axis.place, "bits-motion"),
        cause=Cause(now.heard.name, "homed"),
        came=now.heard.raw,
    )


def _judge(axis: Axis, before: Status, seen: Watched, strays: Decision) -> None:
    end = judge_end(axis, _HOME, seen, HOMED)
    _judge_way(axis, seen.statuses)
    if end is not None and not judge_over(axis, _HOME, end, seen, strays=strays):
        axis.start = axis.position()
        return
    status = judge_rest(axis, _HOME)
    axis.start = _way_back(axis, before, seen.statuses, status)
    if end is None or end.name != HOMED:
        return
    axis.trial.must(
        status.bits.homed,
        f"{axis.text} sent {HOMED}, but {status.heard.name} does not report homed",
        rule=rule_of_status(axis.place, "bits-motion"),
        cause=Cause(status.heard.name, "homed"),
        came=status.heard.raw,
    )
    axis.trial.must(
        abs(status.position) <= HELD,
        f"{axis.text} sent {HOMED}, but its position is {status.position}; it should count "
        "from home, which is 0",
        rule="position-after-homing",
        cause=Cause("MOT_MOVE_HOME", "position"),
        came=status.heard.raw,
    )
    if "MOT_REQ_POSCOUNTER" in axis.place.messages:
        counter = axis.ask(m.MotReqPosCounter(axis.channel))
        position: int = counter.message.position
        axis.trial.must(
            abs(position - status.position) <= HELD,
            f"{axis.text}: after homing, MOT_GET_POSCOUNTER has {position}, but "
            f"{status.heard.name} has {status.position}; the counter should show the actual "
            "position",
            rule="position-after-homing",
            cause=Cause("MOT_GET_POSCOUNTER", "position"),
            came=counter.raw,
        )


def unsafe(axis: Axis) -> str:
    """Return why the motor might run into a mechanical end while it homes; empty if it should not.

    Home parameters of zero have driven stages into their ends. Stages of brushless controllers, which have
    stage axis parameters, ignore all of them but the velocity (pages 37 and 39; Issue 37, page 76).
    """
    place = axis.place
    if "MOT_REQ_HOMEPARAMS" not in place.messages or place.brushless:
        return ""
    told = axis.ask(m.MotReqHomeParams(axis.channel)).message
    if told.limit_switch == 0:
        return "its home parameters name no limit switch, so it might run into its mechanical end"
    return ""


def _judge_way(axis: Axis, statuses: Sequence[Status]) -> None:
    shown = any(status.bits.homing for status in statuses)
    for earlier, status in pairwise(statuses):
        if shown and earlier.time - statuses[0].time < _LATE:
            continue
        if abs(status.position - earlier.position) > _MOVES and not earlier.bits.homing:
            axis.trial.must(
                False,
                f"{axis.text}: at {earlier.position} on its way home, {earlier.heard.name} does "
                "not report homing",
                rule=rule_of_status(axis.place, "bits-motion"),
                cause=Cause(earlier.heard.name, "homing"),
                came=earlier.heard.raw,
            )
            return


def _way_back(axis: Axis, before: Status, way: Sequence[Status], now: Status) -> int:
    """Return the previous position in the current count, or the current one if it cannot be reached."""
    stood = before.position
    if not before.bits.homed and way:
        stood += now.position - way[-1].position
    if axis.can_return_to(stood):
        return stood
    nearest = max(
        axis.low, min(now.position, axis.high)
    )  # it may oscillate at the end of the range
    return nearest if abs(now.position - nearest) <= HELD else now.position

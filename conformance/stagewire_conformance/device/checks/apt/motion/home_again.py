"""Homing once more: it obeys its velocity (page 37), and its end message can be suspended (page 82).

The motor must be homed, so that its way home is known. It begins near its home.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HOMED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.course import points_of, top_speed
from stagewire_conformance.device.checks.apt.motion.home import homing_bound, lacks_home, unsafe
from stagewire_conformance.device.checks.apt.motion.judgement import judge_end
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute, move
from stagewire_conformance.device.checks.apt.motion.pace import home_pace_of
from stagewire_conformance.device.checks.apt.motion.parameters import messages_of
from stagewire_conformance.device.checks.apt.motion.profile_laws import search, velocity_law
from stagewire_conformance.device.checks.apt.motion.suspension import judge_silence, suspend
from stagewire_conformance.device.checks.apt.motion.watch import Decision, Watched, watch

_SPOILT: Final = (Cause("MOT_MOVE_HOME", "position"), Cause(HOMED, "early"))
"""The defects of homing with which it cannot be judged."""
_SECONDS: Final = 0.6
"""The approximate duration of the way home in seconds."""
_LEAST: Final = 200
"""Counts of the shortest way home."""
_LIMIT: Final = 30.0
"""Seconds after which homing is stopped."""
_IMPOSSIBLE: Final = 50
"""The multiple of the velocity of moves at which no motor homes."""

KIND = Kind(
    name="home-again",
    title="Homing obeys its velocity, and its end message can be suspended",
    rules=("home-starts", "home-parameters-mls203", "end-messages-suspended", *MOTION_BITS),
)


@motor_check(
    KIND,
    "MOT_MOVE_HOME homes {motors} with the velocity of MOT_SET_HOMEPARAMS",
    messages=("MOT_MOVE_HOME", HOMED, *messages_of("HOMEPARAMS"), "MOT_MOVE_ABSOLUTE", COMPLETED),
    does="lowers the homing velocity with MOT_SET_HOMEPARAMS step by step, homes all motors together from "
    "near their homes, and restores the parameters",
    settings=True,
    seconds=6.5,
    lacks=lacks_home,
    name="velocity",
)
def _velocity(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(*_SPOILT)
    places = _places(axes)
    strays = _strays(places)

    def speeds(moving: Sequence[Axis]) -> Mapping[Axis, float]:
        """Home once from the places, and return the highest speed of each motor."""
        if not move([absolute(axis, places[axis]) for axis in moving]):
            return {}
        for axis in moving:
            axis.send(m.MotMoveHome(axis.channel))
        seen = watch(moving, dict.fromkeys(moving, _LIMIT), strays=strays)
        found = {}
        for axis in moving:
            on_its_way = [status for status in seen[axis].statuses if status.bits.homing]
            if not judge_end(axis, "MOT_MOVE_HOME", seen[axis], HOMED):
                continue
            if len(on_its_way) > 1:
                found[axis] = top_speed(points_of(on_its_way))
            else:  # it took no time
                _judge_no_time(axis, places[axis], seen[axis])
        return found

    law = velocity_law("MOT_SET_HOMEPARAMS", "home_velocity", "homing")
    search(list(places), law, speeds)


def _judge_no_time(axis: Axis, place: int, seen: Watched) -> None:
    """Report homing that ended before the motor can have moved."""
    speed = abs(place) / max(seen.seconds, 1e-3)
    axis.trial.must(
        speed <= _IMPOSSIBLE * axis.pace.fastest.velocity,
        f"{axis.text}: MOT_MOVE_HOME at {place} was followed by {HOMED} after {seen.seconds:.3f} s, and "
        "no status reported homing; it should have moved home",
        rule="home-starts",
        cause=Cause("MOT_MOVE_HOME", EFFECT),
        came=seen.ends[0].raw,
    )


@motor_check(
    KIND,
    "The end message of MOT_MOVE_HOME of {motors} can be suspended",
    messages=(
        "MOT_MOVE_HOME",
        "MOT_SUSPEND_ENDOFMOVEMSGS",
        "MOT_RESUME_ENDOFMOVEMSGS",
        "MOT_MOVE_ABSOLUTE",
    ),
    does="homes all motors together from near their homes, while their end-of-move messages are suspended",
    seconds=4.0,
    lacks=lacks_home,
    name="suspended",
)
def _suspended(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(*_SPOILT)
    places = _places(axes)
    if not places or not move([absolute(axis, place) for axis, place in places.items()]):
        return

    def is_home(axis: Axis, status: Status) -> bool:
        return status.bits.homed and not status.moving

    suspend(list(places))
    for axis in places:
        axis.send(m.MotMoveHome(axis.channel))
    limits = dict.fromkeys(places, _LIMIT)
    seen = watch(list(places), limits, strays=_strays(places), done=is_home)
    ends = [heard for each in seen.values() for heard in each.ends]
    judge_silence(axes, "MOT_MOVE_HOME", ends)


def _strays(places: Mapping[Axis, int]) -> Decision:
    """Return whether a motor has gone further than homing may need."""
    most = {axis: homing_bound(axis)[0] for axis in places}
    return lambda axis, status: abs(status.position - places[axis]) > most[axis]


def _places(axes: Sequence[Axis]) -> dict[Axis, int]:
    """Return a position near home for each motor that can be homed from there."""
    places = {}
    for axis in axes:
        homed = axis.status().bits.homed
        why = unsafe(axis) if homed else "it was not homed before, so its way home is unknown"
        pace = home_pace_of(axis.trial, axis.place, axis.channel, axis.pace)
        room = max(axis.inner, key=abs)
        way = max(_LEAST, min(abs(room), pace.distance(_SECONDS)))
        if not why and abs(room) < _LEAST:
            why = f"only {abs(room)} counts are allowed on its way"
        if why:
            axis.trial.inconclusive(f"{axis.text} was not homed: {why}")
        else:
            places[axis] = way if room > 0 else -way
    return places

"""``limits``: a limit switch stops a motor, which reports the end of the motion and the switch.

Each motor goes to the ends of its travel within the range, slowly for the last part. Before that, the
status bits of a short move show which direction leads there, because no page states in which direction
positions rise. The PICS must declare the travel and the switches, and the motor must be homed, so that the
positions of the ends are known. Brushless controllers have no limit switch parameters (page 39), and are left
out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import HardLimit, MoveDirection, StopMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_status
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.judgement import judge_end, judge_rest
from stagewire_conformance.device.checks.apt.motion.motor_check import MOTION_BITS, motor_check
from stagewire_conformance.device.checks.apt.motion.moves import absolute, move
from stagewire_conformance.device.checks.apt.motion.pace import pace_of
from stagewire_conformance.device.checks.apt.motion.parameters import change, present
from stagewire_conformance.device.checks.apt.motion.runs import slow_down
from stagewire_conformance.device.checks.apt.motion.stopping import need_stops
from stagewire_conformance.device.checks.apt.motion.watch import Watched, watch

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.motion.motor_check import Motor
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target, Travel


_PARAMETERS: Final = "MOT_SET_LIMSWITCHPARAMS"
_VELPARAMS: Final = "MOT_SET_VELPARAMS"
_FARTHEST: Final = 8.0
"""The most seconds that the way from one end to the other may take."""
_APPROACH: Final = 0.3
"""The approximate duration of the last part in seconds."""
_BEYOND: Final = 100
"""A switch may be beyond the declared end by this fraction of the travel."""
_SWITCHES: Final = (HardLimit.MAKES, HardLimit.BREAKS)
"""The settings with which a switch stops any motion (page 39)."""
_VALUE: Final = 0x7F
"""The mask without the bit that swaps the switches."""


@dataclass(frozen=True)
class _End:
    """The end of the travel to which a motor runs.

    :param way: 1 for the upper end, -1 for the lower one.
    :param direction: the direction that leads there.
    :param place: the position of the end in counts.
    :param beyond: counts by which the switch may be beyond the end.
    """

    axis: Axis
    way: int
    direction: MoveDirection
    place: int
    beyond: int

    @property
    def told(self) -> str:
        """The command, for sentences."""
        return f"MOT_MOVE_VELOCITY {self.direction.name.lower()} to the end of the travel at {self.place}"

    @property
    def last(self) -> int:
        """The length in counts of the last, slow part."""
        backlash = abs(self.axis.backlash) + 1
        return max(1, backlash, self.axis.pace.distance(_APPROACH))

    def passed(self, status: Status, times: int = 1) -> bool:
        """Return whether a motor is further beyond the end than a switch may be."""
        return (status.position - self.place) * self.way > times * self.beyond

    def left(self, status: Status) -> bool:
        """Return whether a motor that was near the end has moved away from it."""
        return (self.place - status.position) * self.way > 2 * self.last + HELD


def _ways(declared: Declaration, allowed: Permissions, place: Target, channel: int) -> list[int]:
    """Return the ways (1 up, -1 down) in which an end of the travel is within the range."""
    travel = place.travel_of(channel)
    if travel is None or allowed.motion is None:
        return []
    low, high = declared.reach(place, channel, allowed.motion)
    return [way for way, lies in ((-1, low == travel.low), (1, high == travel.high)) if lies]


def _lacks(declared: Declaration, allowed: Permissions, motor: Motor) -> str:
    place, channel = motor
    what = f"channel {channel} of {place.name}"
    travel = place.travel_of(channel)
    if not place.connected_to(channel).limit_switches:
        return f"the PICS states that {what} has no limit switches"
    if place.brushless:
        return f"{what} is brushless: its axis limits can end the travel before its switches do"
    if travel is None:
        return f"the PICS declares no travel of {what}, so the positions of its ends are unknown"
    if allowed.motion and not _ways(declared, allowed, place, channel):
        return f"no end of the travel of {what} ({travel} counts) is within {allowed.motion}"
    return ""


LIMITS: Final = Cause("limits", EFFECT)
"""The defect that a motor passes its limits."""

KIND = Kind(
    name="limits",
    title="A limit switch stops a motion, and is reported",
    rules=(
        "velocity-move-until-limit",
        "velocity-move-completed",
        "status-bits-limits",
        "dc-status-bits-limits",
        *MOTION_BITS,
    ),
)


@motor_check(
    KIND,
    "A limit switch of {motors} stops a motion and is reported",
    messages=(
        "MOT_MOVE_VELOCITY",
        "MOT_MOVE_ABSOLUTE",
        "MOT_REQ_LIMSWITCHPARAMS",
        "MOT_GET_LIMSWITCHPARAMS",
        "MOT_SET_VELPARAMS",
        "MOT_REQ_VELPARAMS",
        "MOT_GET_VELPARAMS",
        COMPLETED,
    ),
    does="runs all motors together slowly into the limit switches at the ends of the travel that are "
    "within {range}, and returns",
    settings=True,
    seconds=8.0,
    lacks=_lacks,
    also=("MOT_REQ_HOMEPARAMS", "MOT_GET_HOMEPARAMS"),
    only=_PARAMETERS,
)
def _run(axes: Sequence[Axis]) -> None:
    # Without its home, the positions of the ends are unknown; without its commands, it does not get there.
    axes[0].trial.depends_on(
        *(Cause("MOT_MOVE_HOME", aspect) for aspect in (EFFECT, "position")),
        Cause("MOT_MOVE_VELOCITY", EFFECT),
        Cause("MOT_MOVE_HOMED", "early"),
    )
    homed = [axis for axis in axes if _is_homed(axis)]
    shown = [absolute(axis, axis.start + axis.distance(axis.start, _APPROACH)) for axis in homed]
    if not shown or not move(shown):
        return
    ends = {axis: found for axis in homed if (found := _ends_of(axis))}
    need_stops(axes)
    before = {axis: present(axis, _VELPARAMS)["max_velocity"] for axis in ends}
    for number in range(max(map(len, ends.values()), default=0)):
        if number:
            for axis in ends:
                change(axis, _VELPARAMS, at_most="max_velocity", max_velocity=before[axis])
        if not _run_into({axis: each[number] for axis, each in ends.items() if number < len(each)}):
            return
    for axis in ends:
        change(axis, _VELPARAMS, at_most="max_velocity", max_velocity=before[axis])
    if ends and move([absolute(axis, axis.start) for axis in ends]):
        for axis, each in ends.items():
            _judge_left(axis, each)


def _judge_left(axis: Axis, ends: Sequence[_End]) -> None:
    """Report a limit switch that is still active although the motor has left it."""
    status = axis.status()
    for end in ends:
        name = end.direction.name.lower()
        near = abs(status.position - end.place) <= 2 * end.beyond + HELD
        axis.trial.must(
            near or not getattr(status.bits, f"{name}_hardware_limit"),
            f"{axis.text} has left its end at {end.place} and is at {status.position}, but "
            f"{status.heard.name} still reports its {name} limit switch as active",
            rule=rule_of_status(axis.place, "bits-limits"),
            cause=Cause(status.heard.name, "limit switches"),
            came=status.heard.raw,
        )


def _run_into(ends: Mapping[Axis, _End]) -> bool:
    """Move motors near ends of their travel, and then run them into the switches; return whether all stop."""
    far = [
        absolute(axis, end.place - end.way * end.last)
        for axis, end in ends.items()
        if abs(axis.status().position - end.place) > end.last
    ]
    if not ends or (far and not move(far)):
        return False

    def passed(axis: Axis, status: Status) -> bool:
        return ends[axis].passed(status)

    limits = {}
    for axis, end in ends.items():
        axis.pace = pace_of(axis.trial, axis.place, axis.channel).fastest.as_measured()
        limits[axis] = axis.pace.slower(slow_down(axis, 4 * end.last)).bound(end.last + end.beyond)
    for axis, end in ends.items():
        axis.send(m.MotMoveVelocity(axis.channel, end.direction))

    def strays(axis: Axis, status: Status) -> bool:
        end = ends[axis]
        return end.passed(status, times=3) or end.left(status)

    seen = watch(list(ends), limits, stop=passed, mode=StopMode.IMMEDIATE, strays=strays)
    stopped = [_judge(axis, end, seen[axis]) for axis, end in ends.items()]
    return all(stopped)


def _is_homed(axis: Axis) -> bool:
    homed: bool = axis.status().bits.homed
    if not homed:
        axis.trial.inconclusive(
            f"{axis.text} is not homed, so the positions of its ends are unknown"
        )
    return homed


def _ends_of(axis: Axis) -> list[_End]:
    """Return the ends to which a motor runs, the nearest first; none if it may not run to any.

    The other end is left out if it is too far away.
    """
    trial, place = axis.trial, axis.place
    travel: Travel | None = place.travel_of(axis.channel)
    assert travel is not None  # otherwise the check does not run
    if not axis.clockwise:
        trial.inconclusive(
            f"{axis.text} sent no status on its way, so the direction of each end is unknown"
        )
        return []
    told = axis.ask(m.MotReqLimSwitchParams(axis.channel)).message
    switches = {axis.clockwise: told.cw_hard_limit, -axis.clockwise: told.ccw_hard_limit}
    ways = [
        way
        for way in _ways(trial.declared, trial.allowed, place, axis.channel)
        if switches[way] & _VALUE in _SWITCHES
    ]
    if not ways:
        trial.inconclusive(f"{axis.text}: no limit switch within reach is set to stop a motion")
        return []
    places = {1: travel.high, -1: travel.low}
    beyond = max(1, (travel.high - travel.low) // _BEYOND)
    offset = _home_offset(axis)
    shifted = [way for way in ways if abs(places[way]) <= beyond < offset]
    ways = [way for way in ways if way not in shifted]
    if not ways:
        trial.inconclusive(
            f"{axis.text}: its zero is {offset} counts away from the switch with which it homes "
            "(offset_distance of MOT_GET_HOMEPARAMS), so the end of the travel at "
            f"{places[shifted[0]]} is not that switch; declare the travel from switch to switch"
        )
        return []
    nearest, *others = sorted(ways, key=lambda each: abs(places[each] - axis.start))
    pace = axis.pace.as_measured()
    near = [way for way in others if pace.seconds(places[way] - places[nearest]) <= _FARTHEST]
    if len(near) < len(others):
        trial.info(
            f"{axis.text}: the other end, at {places[others[0]]}, was left out: it is more than "
            f"{_FARTHEST:g} s away"
        )
    ends = []
    for way in (nearest, *near):
        direction = axis.direction_of(way)
        assert direction is not None
        ends.append(_End(axis, way, direction, places[way], beyond))
    return ends


def _home_offset(axis: Axis) -> int:
    """Return the distance from the switch where a motor homes to its zero; 0 if it reports none."""
    if "MOT_REQ_HOMEPARAMS" not in axis.place.messages:
        return 0
    distance: int = axis.ask(m.MotReqHomeParams(axis.channel)).message.offset_distance
    return abs(distance)


def _judge(axis: Axis, end: _End, seen: Watched) -> bool:
    """Report what is wrong with a motor that ran into a switch; return whether the switch stopped it."""
    if seen.strayed is not None and end.left(seen.strayed):
        axis.trial.must(
            False,
            f"{axis.text}: after {end.told}, it went the other way, to {seen.strayed.position}, "
            f"and was stopped; before, it reported motion {end.direction.name.lower()} towards "
            "that end",
            rule="velocity-move",
            cause=Cause("MOT_MOVE_VELOCITY", EFFECT),
            because=(Cause(axis.status_name, "motion bits on the way"),),
            came=seen.strayed.heard.raw,
        )
        return False
    if beyond := seen.strayed or seen.stopped:
        axis.trial.must(
            False,
            f"{axis.text}: after {end.told}, it ran on to {beyond.position} and was stopped; "
            "its limit switch should have stopped it",
            rule="velocity-move-until-limit",
            cause=LIMITS,
            came=beyond.heard.raw,
        )
        return False
    if (message := judge_end(axis, end.told, seen, COMPLETED)) is None:
        return False
    status = judge_rest(axis, end.told, message)
    stopped = axis.trial.must(
        abs(status.position - end.place) <= end.beyond,
        f"{axis.text}: after {end.told}, it is at {status.position}, away from the end",
        rule="velocity-move-until-limit",
        came=status.heard.raw,
    )
    name = end.direction.name.lower()
    bits = status.bits
    hard = getattr(bits, f"{name}_hardware_limit")
    axis.trial.must(
        hard or getattr(bits, f"{name}_software_limit", False),
        f"{axis.text}: after {end.told}, it is at {status.position}, but {status.heard.name} "
        f"does not report its {name} limit switch as active",
        rule=rule_of_status(axis.place, "bits-limits"),
        cause=Cause(status.heard.name, "limit switches"),
        came=status.heard.raw,
    )
    return stopped

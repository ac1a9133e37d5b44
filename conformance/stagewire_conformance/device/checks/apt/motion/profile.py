"""``profile``: moves and jogs obey their maximum velocity and their acceleration (pages 30 and 32).

Speeds and durations at several settings are compared, so that no scale is needed. If the registry has a
scale, the speed is also compared with the setting. Settings are only lowered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.axis import COMPLETED, Axis
from stagewire_conformance.device.checks.apt.motion.jogs import JOGS
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import distances, long_enough, make_room
from stagewire_conformance.device.checks.apt.motion.pace import (
    acceleration_scale,
    is_printed,
    jog_pace_of,
    velocity_scale,
)
from stagewire_conformance.device.checks.apt.motion.parameters import (
    change,
    jog_single_steps,
    messages_of,
    present,
    switch_backlash_off,
)
from stagewire_conformance.device.checks.apt.motion.profile_laws import Profile, Search
from stagewire_conformance.device.checks.apt.motion.shuttle import Course, JogShuttle, Shuttle
from stagewire_conformance.device.checks.apt.motion.velocities import AT_REST, HIGHEST, SIGN

_SECONDS: Final = 0.3
"""The approximate duration of the first move in seconds."""
_OFF: Final = 0.35
"""The relative tolerance of a speed."""
_FASTER: Final = 1.1
"""The ratio of a constant speed to the maximum velocity from which the motor is too fast."""
_MIDDLE: Final = 1.37
"""Acceleration of a move without a constant speed, if its way and its speed in the middle half are 1."""
_RAMP: Final = 1.5
"""The ratio of an acceleration to its parameter, or the inverse, from which it is wrong."""
_EXACT: Final = 0.1
"""The relative difference up to which a speed is that of the setting in counts/s."""
_LONGER: Final = 1.25
"""The ratio of the durations of a jog and a move from which their accelerations differ."""
_BEYOND: Final = 1.3
"""The least ratio of the speed of a move to that of a jog with at most half its velocity."""
_TELLABLE: Final = 40
"""The least velocity in a status whose quarter is precise enough to be compared."""
_TOO_SHORT: Final = "a move of {} counts is too short to measure its speed"

_VELPARAMS: Final = messages_of("VELPARAMS")
_JOGPARAMS: Final = messages_of("JOGPARAMS")


_MOVES: Final = Profile("a move", "MOT_SET_VELPARAMS", "max_velocity", "acceleration")
_JOGS: Final = Profile("a jog", "MOT_SET_JOGPARAMS", "jog_max_velocity", "jog_acceleration")


KIND = Kind(
    name="profile",
    title="Moves and jogs obey their velocity and their acceleration",
    rules=(
        "velocity-parameters",
        "jog-parameters",
        "dc-status-velocity",
        "slot-addressed-by-destination",
        "module-channels",
    ),
)


@motor_check(
    KIND,
    "MOT_SET_VELPARAMS sets the velocity and the acceleration of moves of {motors}",
    messages=("MOT_MOVE_ABSOLUTE", *_VELPARAMS, COMPLETED),
    does="lowers velocity and acceleration with MOT_SET_VELPARAMS step by step, moves all motors "
    "together back and forth within {range}, and restores the parameters",
    settings=True,
    seconds=5.0,
    name="moves",
)
def _moves(axes: Sequence[Axis]) -> None:
    for axis in axes:
        switch_backlash_off(axis)  # it would make moves in one direction longer
    ways = long_enough(distances(axes, _SECONDS), _TOO_SHORT)
    if not ways:
        return
    shuttle = Shuttle(ways)
    before = {axis: _MOVES.velocity_of(axis) for axis in ways}
    _MOVES.differ(list(ways), _MOVES.velocity)
    found = _MOVES.search_velocity(list(ways), shuttle)
    if not _MOVES.judge_apart(found, _MOVES.velocity, _last(found)):
        return
    for axis, each in found.items():
        _judge_scale(axis, each.values[-1], shuttle.courses[axis][-1], _MOVES)
        _judge_reported(axis, shuttle.courses[axis])
    units = {
        axis: shuttle.courses[axis][-1].steady / each.values[-1] for axis, each in found.items()
    }
    for axis in found:
        _MOVES.restore_velocity(axis, before[axis])
    _MOVES.differ(list(found), _MOVES.acceleration)
    ramps = _MOVES.search_acceleration(found, shuttle)
    measured = {axis: shuttle.courses[axis][-1].ramp_of_triangle for axis in ramps}
    if not _MOVES.judge_apart(ramps, _MOVES.acceleration, measured):
        return
    for axis, each in ramps.items():
        _judge_ramp(axis, each.values[-1], shuttle.courses[axis][-1], units[axis])


@motor_check(
    KIND,
    "MOT_SET_JOGPARAMS sets the velocity and the acceleration of jogs of {motors}",
    messages=("MOT_MOVE_JOG", "MOT_MOVE_ABSOLUTE", *_JOGPARAMS, *_VELPARAMS, COMPLETED),
    does="lowers velocity and acceleration with MOT_SET_JOGPARAMS step by step, jogs all motors "
    "together back and forth within {range}, and restores the parameters",
    settings=True,
    seconds=11.0,
    name="jogs",
)
def _jogs(axes: Sequence[Axis]) -> None:
    axes[0].trial.depends_on(JOGS)
    for axis in axes:
        switch_backlash_off(axis)
    steps = long_enough(
        {
            axis: axis.step(_SECONDS, jog_pace_of(axis.trial, axis.place, axis.channel))
            for axis in axes
        },
        _TOO_SHORT,
    )
    if not steps or not make_room(steps):
        return
    jog_single_steps(steps)
    shuttle = JogShuttle(steps)
    before = {axis: _JOGS.velocity_of(axis) for axis in steps}
    _JOGS.differ(list(steps), _JOGS.velocity)
    found = _JOGS.search_velocity(list(steps), shuttle)
    if not _JOGS.judge_apart(found, _JOGS.velocity, _last(found)):
        return
    _judge_moves_after_jogs(steps, found)
    fast = {axis: _MOVES.velocity_of(axis) for axis in found}
    same_moves = _same_moves(steps, found, _MOVES.velocity)
    moves = same_moves.speeds(list(same_moves.ways))
    same_moves.speeds(list(moves))  # back, so that the next jogs have room
    for axis, each in found.items():
        _judge_scale(axis, each.values[-1], shuttle.courses[axis][-1], _JOGS)
        if axis in moves:
            _judge_alike(axis, each, moves[axis], _MOVES.velocity_of(axis))
        _JOGS.restore_velocity(axis, before[axis])
        _MOVES.restore_velocity(axis, fast[axis])
    found = _JOGS.search_acceleration(found, shuttle)
    same_moves = _same_moves(steps, found, _MOVES.acceleration)
    took = same_moves.durations(list(same_moves.ways))
    for axis, each in found.items():
        if axis in took:
            _judge_alike_ramps(axis, each, took[axis])


def _last(found: Mapping[Axis, Search]) -> dict[Axis, float]:
    """Return the last measurement of each motor."""
    return {axis: each.found[-1] for axis, each in found.items()}


def _judge_moves_after_jogs(steps: Mapping[Axis, int], found: Mapping[Axis, Search]) -> None:
    """Report moves that are not faster than slow jogs over the same distance before them.

    The jogs are so slow that they reach a constant speed. Moves with at least the acceleration of the jogs
    and twice their velocity go beyond that speed.
    """
    faster = {}
    for axis, each in found.items():
        jogs, moves = present(axis, _JOGS.setting), present(axis, _MOVES.setting)
        place = axis.position()
        if (
            moves[_MOVES.velocity] >= 2 * each.values[-1]
            and moves[_MOVES.acceleration] >= jogs[_JOGS.acceleration]
            and axis.low <= place <= axis.high
        ):
            faster[axis] = place
    shuttle = Shuttle({axis: axis.wider(at) * steps[axis] for axis, at in faster.items()}, faster)
    speeds = shuttle.speeds(list(faster))
    shuttle.speeds(list(speeds))  # back, so that the next jogs have room
    for axis, speed in speeds.items():
        jog = found[axis].found[-1]
        axis.trial.must(
            speed >= _BEYOND * jog,
            f"{axis.text}: after jogs at {jog:.0f} counts/s with jog_max_velocity = "
            f"{found[axis].values[-1]}, a move with max_velocity = {_MOVES.velocity_of(axis)} reached only "
            f"{speed:.0f} counts/s; moves have their own velocity and acceleration",
            rule="velocity-parameters",
            cause=_MOVES.defect,
        )


def _same_moves(steps: Mapping[Axis, int], found: Mapping[Axis, Search], name: str) -> Shuttle:
    """Set a parameter of moves to the last value of jogs; return moves over the steps of the jogs.

    Motors with a counter outside of the range are left out: the counter is wrong.
    """
    places = {axis: axis.position() for axis in found}
    begins = {axis: at for axis, at in places.items() if axis.low <= at <= axis.high}
    for axis, each in found.items():
        value = min(each.values[-1], present(axis, "MOT_SET_VELPARAMS")[name])
        change(axis, "MOT_SET_VELPARAMS", at_most=name, **{name: value})
    return Shuttle({axis: axis.wider(begins[axis]) * steps[axis] for axis in begins}, begins)


def _judge_alike(axis: Axis, jogs: Search, speed: float, velocity: int) -> None:
    """Compare the speed of a jog with that of a move: both velocities have the same unit."""
    due = speed / velocity * jogs.values[-1]
    # If the jog is as fast as printed, in counts/s, the move is wrong.
    in_counts = abs(jogs.found[-1] - jogs.values[-1]) <= _EXACT * jogs.values[-1]
    axis.trial.must(
        abs(jogs.found[-1] - due) <= _OFF * due,
        f"{axis.text}: with jog_max_velocity = {jogs.values[-1]}, a jog reached {jogs.found[-1]:.0f} "
        f"counts/s, but with max_velocity = {velocity}, a move reached {speed:.0f} counts/s; both "
        "velocities have the same unit",
        rule="velocity-parameters" if in_counts else "jog-parameters",
        cause=_MOVES.defect if in_counts else _JOGS.defect,
        because=(_MOVES.defect,),
    )


def _judge_alike_ramps(axis: Axis, jogs: Search, took: float) -> None:
    """Compare the duration of a jog with that of a move over the same distance with the same acceleration."""
    same = present(axis, "MOT_SET_VELPARAMS")["acceleration"] == jogs.values[-1]
    axis.trial.must(
        not same or took / _LONGER <= jogs.found[-1] <= took * _LONGER,
        f"{axis.text}: with an acceleration of {jogs.values[-1]}, a jog took {jogs.found[-1]:.2f} s, and a "
        f"move over the same distance took {took:.2f} s; both accelerations have the same unit",
        rule="jog-parameters",
        cause=Cause("MOT_SET_JOGPARAMS", "jog_acceleration"),
        because=(Cause("MOT_SET_VELPARAMS", "acceleration"),),
    )


def _judge_scale(axis: Axis, velocity: int, course: Course, profile: Profile) -> None:
    """Compare the measured speed with the velocity parameter.

    If the document does not have its scale, a controller may also take the printed unit literally, which is
    the count/s. With an unknown scale, a motor may be slower than that, but not faster.
    """
    scale = velocity_scale(axis.place, axis.channel)
    scales = {1.0 if scale is None else scale}
    if not is_printed(axis.place, axis.channel):
        scales.add(1.0)
    dues = [velocity * each for each in sorted(scales)]
    axis.trial.must(
        any(
            (scale is None or course.speed >= (1 - _OFF) * due)
            and course.speed <= (1 + _OFF) * due
            and course.steady <= _FASTER * due
            for due in dues
        ),
        f"{axis.text}: with a maximum velocity of {velocity}, which is "
        f"{' or '.join(f'{due:.0f}' for due in dues)} counts/s, {profile.what} reached "
        f"{course.speed:.0f} counts/s, and {course.steady:.0f} counts/s on average in the middle of its way",
        rule=rule_of_set(profile.setting),
        cause=profile.defect,
        because=() if profile is _MOVES else (_MOVES.defect,),
    )


def _judge_ramp(axis: Axis, value: int, course: Course, unit: float) -> None:
    """Compare the acceleration of a move that only sped up and slowed down with its parameter.

    It is in counts/s² if the velocity is in counts/s. Otherwise, both are changes per servo cycle. A
    controller may report the end of a move later, when the motor has settled. So a move that seems slow is
    also judged by its speed in the middle of its way.

    :param unit: the measured speed in counts/s of one unit of velocity.
    """
    scale = acceleration_scale(axis.place, axis.channel, unit)
    if scale is None or axis.trial.causes.check_of(_MOVES.defect):
        return
    due, ramp = value * scale, course.ramp_of_triangle
    in_the_middle = _MIDDLE * course.steady**2 / course.way
    axis.trial.must(
        due / _RAMP <= ramp <= _RAMP * due
        or (ramp < due and due / _RAMP <= in_the_middle <= _RAMP * due),
        f"{axis.text}: with an acceleration of {value}, which is {due:.0f} counts/s², a move over "
        f"{course.way} counts took {course.seconds:.2f} s, as with {ramp:.0f} counts/s²",
        rule="velocity-parameters",
        cause=Cause(_MOVES.setting, _MOVES.acceleration),
    )


def _judge_reported(axis: Axis, courses: Sequence[Course]) -> None:
    """Compare the ratio of the reported velocities of a fast and a slow move with that of their speeds."""
    fast, slow = courses[-2:]
    if slow.reported is None or fast.reported is None or not _TELLABLE <= fast.reported < HIGHEST:
        return
    reported, measured = slow.reported / fast.reported, slow.speed / fast.speed
    axis.trial.must(
        measured / 2 <= reported <= 2 * measured,
        f"{axis.text}: at {fast.speed:.0f} and {slow.speed:.0f} counts/s, the highest velocities in "
        f"its statuses were {fast.reported} and {slow.reported}; they should have the same ratio",
        rule="dc-status-velocity",
        cause=Cause(axis.status_name, "velocity"),
        because=tuple(Cause(axis.status_name, aspect) for aspect in (SIGN, AT_REST)),
    )

"""``profile``: moves and jogs obey their maximum velocity and their acceleration (pages 30 and 32).

Speeds and durations at several settings are compared, so that no scale is needed. If the registry has a
scale, the speed is also compared with the setting. Settings are only lowered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, ProfileMode
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis, change, present
from stagewire_conformance.device.checks.apt.motion.motor_check import motor_check
from stagewire_conformance.device.checks.apt.motion.moves import (
    COMPLETED,
    distances,
    make_room,
)
from stagewire_conformance.device.checks.apt.motion.pace import jog_pace_of, velocity_scale
from stagewire_conformance.device.checks.apt.motion.profile_laws import Law, Search, search
from stagewire_conformance.device.checks.apt.motion.shuttle import Course, JogShuttle, Shuttle

_SECONDS: Final = 0.3
"""The approximate duration of the first move in seconds."""
_LEAST: Final = 200
"""Counts of the shortest move that is measured."""
_OFF: Final = 0.35
"""The relative tolerance of a speed."""
_EXACT: Final = 0.1
"""The relative difference up to which a speed is that of the setting in counts/s."""
_LONGER: Final = 1.5
"""The ratio of the durations of a jog and a move from which their accelerations differ."""
_TELLABLE: Final = 40
"""The least velocity in a status whose quarter is precise enough to be compared."""
_MOST: Final = 0x7FFF
"""The highest velocity that a status can represent with a sign."""

_VELPARAMS: Final = ("MOT_SET_VELPARAMS", "MOT_REQ_VELPARAMS", "MOT_GET_VELPARAMS")
_JOGPARAMS: Final = ("MOT_SET_JOGPARAMS", "MOT_REQ_JOGPARAMS", "MOT_GET_JOGPARAMS")


def _velocity_law(setting: str, name: str, what: str) -> Law:
    return Law(
        setting,
        name,
        low=0.15,
        high=0.4,
        measured=f"{what} reached {{:.0f}} counts/s",
        should=f"a quarter of {name} should give a quarter of the speed",
    )


def _acceleration_law(setting: str, name: str, what: str) -> Law:
    return Law(
        setting,
        name,
        low=1.55,
        high=2.7,
        measured=f"{what} took {{:.2f}} s",
        should=f"with a quarter of {name}, it should take twice as long once it only speeds up and "
        "slows down",
    )


KIND = Kind(
    name="profile",
    title="Moves and jogs obey their velocity and their acceleration",
    rules=("velocity-parameters", "jog-parameters", "dc-status-velocity"),
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
    axes = _prepared(axes)
    ways = _long_enough(distances(axes, _SECONDS))
    if not ways:
        return
    shuttle = Shuttle(ways)
    before = {axis: present(axis, "MOT_SET_VELPARAMS")["max_velocity"] for axis in ways}
    law = _velocity_law("MOT_SET_VELPARAMS", "max_velocity", "a move")
    found = search(list(ways), law, shuttle.speeds)
    for axis, each in found.items():
        _judge_scale(axis, each, "a move")
        _judge_reported(axis, shuttle.courses[axis])
        change(axis, "MOT_SET_VELPARAMS", at_most="max_velocity", max_velocity=before[axis])
    law = _acceleration_law("MOT_SET_VELPARAMS", "acceleration", "a move")
    search([axis for axis in found if _is_trapezoidal(axis)], law, shuttle.durations)


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
    axes = _prepared(axes)
    steps = {}
    for axis in axes:
        told = axis.ask(m.MotReqJogParams(axis.channel)).message
        steps[axis] = axis.step(_SECONDS, jog_pace_of(axis.place, axis.channel, told))
    steps = _long_enough(steps)
    if not steps or not make_room(steps):
        return
    for axis, step in steps.items():
        mode = int(JogMode.SINGLE_STEP)
        change(axis, "MOT_SET_JOGPARAMS", jog_mode=mode, jog_step_size=step)
    shuttle = JogShuttle(steps)
    name = "jog_max_velocity"
    before = {axis: present(axis, "MOT_SET_JOGPARAMS")[name] for axis in steps}
    law = _velocity_law("MOT_SET_JOGPARAMS", name, "a jog")
    found = search(list(steps), law, shuttle.speeds)
    fast = {axis: present(axis, "MOT_SET_VELPARAMS")["max_velocity"] for axis in found}
    shuttle_of_moves = _same_moves(steps, found, "max_velocity")
    moves = shuttle_of_moves.speeds(list(shuttle_of_moves.ways))
    shuttle_of_moves.speeds(list(moves))  # back, so that the next jogs have room
    for axis, each in found.items():
        _judge_scale(axis, each, "a jog")
        if axis in moves:
            _judge_alike(
                axis, each, moves[axis], present(axis, "MOT_SET_VELPARAMS")["max_velocity"]
            )
        change(axis, "MOT_SET_JOGPARAMS", at_most=name, **{name: before[axis]})
        change(axis, "MOT_SET_VELPARAMS", at_most="max_velocity", max_velocity=fast[axis])
    law = _acceleration_law("MOT_SET_JOGPARAMS", "jog_acceleration", "a jog")
    found = search([axis for axis in found if _is_trapezoidal(axis)], law, shuttle.durations)
    shuttle_of_moves = _same_moves(steps, found, "acceleration")
    took = shuttle_of_moves.durations(list(shuttle_of_moves.ways))
    for axis, each in found.items():
        if axis in took:
            _judge_alike_ramps(axis, each, took[axis])


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
        cause=Cause(f"MOT_SET_{'VEL' if in_counts else 'JOG'}PARAMS", "max_velocity"),
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
    )


def _prepared(axes: Sequence[Axis]) -> list[Axis]:
    """Switch the backlash correction off, which would make a move in one direction longer."""
    for axis in axes:
        if axis.backlash:
            change(axis, "MOT_SET_GENMOVEPARAMS", backlash_distance=0)
            axis.backlash = 0
    return list(axes)


def _long_enough(ways: Mapping[Axis, int]) -> dict[Axis, int]:
    for axis, way in ways.items():
        if abs(way) < _LEAST:
            axis.trial.inconclusive(
                f"{axis.text}: a move of {abs(way)} counts is too short to measure its speed; allow a "
                "wider range"
            )
    return {axis: way for axis, way in ways.items() if abs(way) >= _LEAST}


def _is_trapezoidal(axis: Axis) -> bool:
    """Return whether the profile has a constant acceleration; the duration of an S-curve has another law."""
    if "MOT_REQ_PMDPROFILEMODEPARAMS" not in axis.place.messages:
        return True
    told = axis.ask(m.MotReqPmdProfileModeParams(axis.channel)).message
    if told.mode == ProfileMode.TRAPEZOIDAL:
        return True
    axis.trial.info(
        f"{axis.text}: its profile is not trapezoidal, so its acceleration was not measured"
    )
    return False


def _judge_scale(axis: Axis, found: Search, what: str) -> None:
    """Compare the measured speed with the velocity parameter, if its scale is known."""
    scale = velocity_scale(axis.place, axis.channel)
    if scale is None:
        return
    due, speed = found.values[-1] * scale, found.found[-1]
    axis.trial.must(
        abs(speed - due) <= _OFF * due,
        f"{axis.text}: with a maximum velocity of {found.values[-1]}, which is {due:.0f} counts/s, "
        f"{what} reached {speed:.0f} counts/s",
        rule="jog-parameters" if "jog" in what else "velocity-parameters",
        cause=Cause(f"MOT_SET_{'JOG' if 'jog' in what else 'VEL'}PARAMS", "max_velocity"),
    )


def _judge_reported(axis: Axis, courses: Sequence[Course]) -> None:
    """Compare the ratio of the reported velocities of a fast and a slow move with that of their speeds."""
    fast, slow = courses[-2:]
    if slow.reported is None or fast.reported is None or not _TELLABLE <= fast.reported < _MOST:
        return
    reported, measured = slow.reported / fast.reported, slow.speed / fast.speed
    axis.trial.must(
        measured / 2 <= reported <= 2 * measured,
        f"{axis.text}: at {fast.speed:.0f} and {slow.speed:.0f} counts/s, the highest velocities in "
        f"its statuses were {fast.reported} and {slow.reported}; they should have the same ratio",
        rule="dc-status-velocity",
        cause=Cause(axis.place.status or "", "velocity"),
    )

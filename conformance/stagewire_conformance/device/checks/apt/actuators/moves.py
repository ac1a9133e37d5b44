"""``actuator-move`` and ``actuator-home``: an actuator goes where it should.

Only its own channel moves, and the end of the motion is reported. Homing is checked on paddles only: a PDXC2
homes to the index of its stage, whose position is not known before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator, Motion
from stagewire_conformance.device.checks.apt.actuators.actuator_check import actuator_check
from stagewire_conformance.device.checks.apt.actuators.families import Family, sets_of
from stagewire_conformance.device.checks.apt.actuators.judgement import (
    arrives,
    judge_end,
    judge_motion,
    judge_others,
    judge_target,
)
from stagewire_conformance.device.checks.apt.actuators.runs import judge_run

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_SECONDS: Final = 0.5
"""The approximate duration of a move in seconds."""
_HOMED: Final = "MOT_MOVE_HOMED"
_RELATIVE: Final = ("PZMOT_MOVE_RELATIVE",)
_BY: Final = "PZMOT_KCUBEMOVERELATIVEPARAMS"
_TO: Final = "PZMOT_KCUBEMOVEABSOLUTEPARAMS"

MOVE = Kind(
    name="actuator-move",
    title="A move of an inertial drive or paddle goes to its target",
    rules=(
        "pzmot-absolute-move",
        "pzmot-channels",
        "pzmot-move-completed",
        "pzmot-move-parameters",
        "absolute-move",
        "move-completed",
        "pol-global-settings",
        "unit-messages",
        "stop-any-move",
        "stop-completed",
    ),
)
HOME = Kind(
    name="actuator-home",
    title="A paddle goes to its home position",
    rules=("home-starts", "home-completed", "pol-global-settings"),
)


def _ends(family: Family) -> tuple[str, ...]:
    return (family.completed,)


@actuator_check(
    MOVE,
    "{actuator} moves to its target and reports it, and no other channel moves",
    messages=_ends,
    does="moves each inertial drive and paddle within {range} and back to its position; without an encoder "
    "it may rest a few steps away",
    seconds=3.0,
)
def _move(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    actuator.prepare()
    others = actuator.others()
    target = actuator.target(_SECONDS)
    for goal in (target, actuator.start):
        judge_motion(actuator, actuator.move(goal), goal, others, actuator.rate)


@actuator_check(
    MOVE,
    "{actuator} moves by a distance and reports it, and no other channel moves",
    messages=lambda family: (*_ends(family), *_RELATIVE),
    does="moves each inertial drive by a distance within {range} and back",
    seconds=2.7,
    fits=lambda place: place.listed.issuperset(_RELATIVE),
    name="relative",
)
def _relative(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    actuator.prepare()
    others = actuator.others()
    way = actuator.target(_SECONDS) - actuator.start
    for distance in (way, -way):
        start = actuator.position()
        told = f"PZMOT_MOVE_RELATIVE by {distance}"
        message = m.PzmotMoveRelative(channel, distance)
        seen = actuator.watch(told, message, start, distance, actuator.rate)
        if not judge_motion(actuator, seen, start + distance, others, actuator.rate):
            return


@actuator_check(
    MOVE,
    "{actuator} moves to its stored position and by its stored distance",
    messages=lambda family: (*_ends(family), *_RELATIVE),
    does="sets the stored position and distance of each inertial drive, and moves by them within {range}",
    writes=lambda family: (_BY, _TO),
    changes=True,
    seconds=2.7,
    fits=lambda place: place.listed.issuperset(_RELATIVE),
    name="stored",
)
def _stored(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    actuator.prepare()
    others = actuator.others()
    target = actuator.target(_SECONDS)
    way = actuator.start - target
    moves = (
        (_TO, "abs_distance", target, m.PzmotMoveAbsoluteHeader, target),
        (_BY, "rel_distance", way, m.PzmotMoveRelativeHeader, actuator.start),
    )
    for name, field, value, kind, goal in moves:
        [placed] = sets_of(trial.declared, place, channel, name)
        values = placed.read(trial)
        placed.undo(trial, values)
        placed.write(trial, {**values, field: value})
        start = actuator.position()
        message = kind(channel)
        told = f"{message.layout.message} without data, with {field} = {value}"
        seen = actuator.watch(told, message, start, goal - start, actuator.rate)
        if not judge_motion(actuator, seen, goal, others, actuator.rate):
            return


@actuator_check(
    MOVE,
    "PZMOT_MOVE_VELOCITY moves {actuator} until it is stopped",
    messages=lambda family: ("PZMOT_MOVE_VELOCITY",),
    does="moves each inertial drive within {range} until a stop",
    seconds=3.7,
    fits=lambda place: "PZMOT_MOVE_VELOCITY" in place.listed,
    name="velocity",
)
def _velocity(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    actuator.prepare()
    judge_run(
        actuator,
        "PZMOT_MOVE_VELOCITY forward",
        m.PzmotMoveVelocity(channel, MoveDirection.FORWARD),
        rate=actuator.rate,
        starts="unit-messages",
        lasts="unit-messages",
    )


@actuator_check(
    HOME,
    "{actuator} goes to its home position and reports it, and no other paddle moves",
    messages=lambda family: ("MOT_MOVE_HOME", _HOMED),
    does="moves each paddle to its home position if it is within {range}, and back",
    reads=lambda family: family.paces,
    seconds=3.4,
    fits=lambda place: "POL_SET_PARAMS" in place.listed,
)
def _home(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    [placed] = sets_of(trial.declared, place, channel, "POL_PARAMS")
    home = placed.read(trial)["home_position"]
    if not actuator.low <= home <= actuator.high:
        trial.inconclusive(
            f"{actuator.text} was not homed: its home position {home} is outside of "
            f"{actuator.low}..{actuator.high}"
        )
        return
    actuator.prepare()
    if actuator.start == home and not arrives(actuator, actuator.target(_SECONDS)):
        return
    others = actuator.others()
    start = actuator.position()
    seen = actuator.watch(
        "MOT_MOVE_HOME", m.MotMoveHome(channel), start, home - start, actuator.rate
    )
    if judge_target(actuator, seen, home, _rule_of_home(actuator, seen)):
        judge_end(actuator, seen, (_HOMED,), "home-completed")
    judge_others(actuator, seen, others)


def _rule_of_home(actuator: Actuator, seen: Motion) -> str:
    """Return the rule of a paddle that is not at its home position after homing."""
    stayed = abs(seen.rest - seen.start) <= actuator.family.tolerance
    return "home-starts" if stayed else "pol-global-settings"

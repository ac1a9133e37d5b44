"""``actuator-move``, ``actuator-jog`` and ``actuator-home``: an actuator goes where it should.

Only its own channel moves, and the end of the motion is reported. Homing is checked on paddles only: a PDXC2
homes to the index of its stage, whose position is not known before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator, Motion
from stagewire_conformance.device.checks.apt.actuators.actuator_check import actuator_check
from stagewire_conformance.device.checks.apt.actuators.families import Family, family_of, sets_of
from stagewire_conformance.device.checks.apt.actuators.judgement import (
    judge_end,
    judge_others,
    judge_pace,
    judge_target,
)

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_SECONDS: Final = 0.5
"""The approximate duration of a move in seconds."""
_HOMED: Final = "MOT_MOVE_HOMED"
_RELATIVE: Final = ("PZMOT_MOVE_RELATIVE",)

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
    ),
)
JOG = Kind(
    name="actuator-jog",
    title="A jog of an inertial drive or paddle moves by its step",
    rules=(
        "pzmot-jog",
        "pzmot-jog-mode",
        "pzmot-channels",
        "pzmot-move-completed",
        "pzmot-move-parameters",
        "pol-jog-step",
        "jog-move-completed",
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
        seen = actuator.move(goal)
        if _judge(actuator, seen, goal, others):
            judge_pace(actuator, seen, actuator.rate)


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
        if not _judge(actuator, seen, start + distance, others):
            return


@actuator_check(
    JOG,
    "A jog of {actuator} moves by its step in both directions, and no other channel moves",
    messages=lambda family: (*_ends(family), _jog_of(family)),
    does="jogs each inertial drive and paddle in both directions within {range}",
    reads=lambda family: family.jogs,
    seconds=4.6,
)
def _jog(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    jog = actuator.jog_parameters()
    room = max(jog.steps)
    if not jog.single or not 0 < room <= (actuator.high - actuator.low) // 2:
        trial.inconclusive(
            f"{actuator.text}: a jog moves by {room} counts"
            f"{'' if jog.single else ' or until it is stopped'}, in both directions; set a single step "
            "that fits twice into the allowed range"
        )
        return
    actuator.prepare()
    middle = min(max(actuator.start, actuator.low + room), actuator.high - room)
    if middle != actuator.start and not _arrives(actuator, middle):
        return
    others = actuator.others()
    ways = []
    for direction, step in zip(MoveDirection, jog.steps, strict=True):
        seen = actuator.jog(direction, step, jog.rate)
        way = seen.rest - seen.start
        goal = seen.start + (step if way > 0 else -step)
        rules = actuator.family.rules
        stayed = abs(way) <= actuator.family.tolerance
        rule = rules.starts_jog if stayed else rules.jog
        if not _judge(actuator, seen, goal, others, rule, _jog_end(actuator)):
            return
        judge_pace(actuator, seen, jog.rate)
        ways.append(way)
    trial.must(
        ways[0] * ways[1] < 0,
        f"{actuator.text}: jogs forward and in reverse moved it by {ways[0]} and by {ways[1]}, in the same "
        "direction",
        rule=actuator.family.rules.jog,
        cause=Cause(_jog_of(actuator.family), EFFECT),
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
    if actuator.start == home and not _arrives(actuator, actuator.target(_SECONDS)):
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


def _arrives(actuator: Actuator, target: int) -> bool:
    """Move to a position before what is checked, and return whether the actuator is there."""
    return judge_target(actuator, actuator.move(target), target, actuator.family.rules.move)


def _judge(
    actuator: Actuator,
    seen: Motion,
    target: int,
    others: dict[int, int],
    rule: str = "",
    end: str = "",
) -> bool:
    """Judge a motion to a target and its end, and return whether it arrived."""
    rules = actuator.family.rules
    arrived = judge_target(actuator, seen, target, rule or rules.move)
    judge_others(actuator, seen, others)
    if arrived:
        judge_end(actuator, seen, _ends(actuator.family), end or rules.ends)
    return arrived


def _jog_of(family: Family) -> str:
    """Return the message that starts a jog."""
    return "MOT_MOVE_JOG" if family.command == "MOT_MOVE_ABSOLUTE" else "PZMOT_MOVE_JOG"


def _jog_end(actuator: Actuator) -> str:
    """Return the rule about the message at the end of a jog."""
    assert family_of(actuator.place) is actuator.family
    paddle = actuator.family.command == "MOT_MOVE_ABSOLUTE"
    return "jog-move-completed" if paddle else actuator.family.rules.ends

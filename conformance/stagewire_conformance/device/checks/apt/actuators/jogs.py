"""``actuator-jog``: a jog moves by its step, or until it is stopped."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, MoveDirection
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator
from stagewire_conformance.device.checks.apt.actuators.actuator_check import actuator_check
from stagewire_conformance.device.checks.apt.actuators.families import (
    PADDLE,
    Family,
    Jog,
    family_of,
    sets_of,
)
from stagewire_conformance.device.checks.apt.actuators.judgement import judge_motion
from stagewire_conformance.device.checks.apt.actuators.runs import goes_to_middle, judge_run

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_STEPS: Final = ("jog_step_size_fwd", "jog_step_size_rev")
"""The fields of a step forward and a step in reverse, if a unit has both."""
_SHORTER: Final = 5
"""A step is this part of the previous one, or shorter by this part, while a check sets it."""
_FARTHER: Final = 1.3
"""A continuous jog is stopped after this many steps, which a single step does not reach."""

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
        "stop-any-move",
        "stop-completed",
    ),
)


def _jog_of(family: Family) -> str:
    """Return the message that starts a jog."""
    return "MOT_MOVE_JOG" if family is PADDLE else "PZMOT_MOVE_JOG"


@actuator_check(
    JOG,
    "A jog of {actuator} moves by its step in both directions, and no other channel moves",
    messages=lambda family: (family.completed, _jog_of(family)),
    does="jogs each inertial drive and paddle in both directions within {range}; with the permission for "
    "settings, the steps of the two directions differ meanwhile",
    reads=lambda family: family.jogs,
    writes=lambda family: family.jogs,
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
    jog = _with_two_steps(actuator, jog)
    if not goes_to_middle(actuator, room):
        return
    others = actuator.others()
    rules = actuator.family.rules
    end = "jog-move-completed" if actuator.family is PADDLE else rules.ends
    ways = []
    for direction, step in zip(MoveDirection, jog.steps, strict=True):
        seen = actuator.jog(direction, step, jog.rate)
        way = seen.rest - seen.start
        goal = seen.start + (step if way > 0 else -step)
        stayed = abs(way) <= actuator.family.tolerance
        rule = rules.starts_jog if stayed else rules.jog
        due = f"it should be {step} counts away"
        if not judge_motion(actuator, seen, goal, others, jog.rate, rule=rule, end=end, due=due):
            return
        ways.append(way)
    trial.must(
        ways[0] * ways[1] < 0,
        f"{actuator.text}: jogs forward and in reverse moved it by {ways[0]} and by {ways[1]}, in the same "
        "direction",
        rule=rules.jog,
        cause=Cause(_jog_of(actuator.family), EFFECT),
    )


def _with_two_steps(actuator: Actuator, jog: Jog) -> Jog:
    """Set a shorter step in reverse if both steps are equal and settings may be changed."""
    trial, (forward, reverse) = actuator.trial, jog.steps
    for placed in sets_of(trial.declared, actuator.place, actuator.channel, *actuator.family.jogs):
        if trial.allowed.settings and not placed.set.skip and placed.set.fields.keys() >= {*_STEPS}:
            values = placed.read(trial)
            if forward == reverse > 1:
                reverse -= max(1, reverse // _SHORTER)
                placed.undo(trial, values)
                placed.write(trial, {**values, _STEPS[1]: reverse})
    return Jog((forward, reverse), jog.rate, jog.single)


@actuator_check(
    JOG,
    "A continuous jog of {actuator} lasts until it is stopped",
    messages=lambda family: (_jog_of(family),),
    does="sets the jog mode of each inertial drive, and jogs it within {range} until a stop",
    reads=lambda family: family.jogs,
    writes=lambda family: family.jogs,
    changes=True,
    seconds=3.8,
    fits=lambda place: family_of(place) is not PADDLE,
    name="continuous",
)
def _continuous(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    jog = actuator.jog_parameters()
    [placed] = sets_of(trial.declared, place, channel, *actuator.family.jogs)
    actuator.prepare()
    values = placed.read(trial)
    placed.undo(trial, values)
    short = {name: max(1, values[name] // _SHORTER) for name in values if "step_size" in name}
    placed.write(trial, {**values, **short, "jog_mode": JogMode.CONTINUOUS})
    rules = actuator.family.rules
    judge_run(
        actuator,
        "PZMOT_MOVE_JOG forward in continuous mode",
        m.PzmotMoveJog(channel, MoveDirection.FORWARD),
        rate=jog.rate,
        least=round(max(jog.steps) / _SHORTER * _FARTHER),
        starts=rules.starts_jog,
        lasts=rules.jog,
    )

"""Parameter sets of a motor that a check changes until its end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire.errors import StagewireError
from stagewire_apt.enumerations import JogMode
from stagewire_conformance.device.causes import EFFECT, SHARED, Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis
from stagewire_conformance.device.checks.apt.motion.watch import drop_ends
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, parameter_sets
from stagewire_conformance.device.trial import EnoughError


def messages_of(parameters: str) -> tuple[str, str, str]:
    """Return the messages that set, request and report parameters: ``VELPARAMS``."""
    return f"MOT_SET_{parameters}", f"MOT_REQ_{parameters}", f"MOT_GET_{parameters}"


def present(axis: Axis, setting: str) -> Values:
    """Return the values of a parameter set, by the name of its SET."""
    return placed_set(axis, setting).read(axis.trial)


def change(axis: Axis, setting: str, *, at_most: str = "", **values: Any) -> None:
    """Change values of a parameter set until the end of the check, and check that they are in effect.

    End the check if they are not: its effect would be unpredictable. End it before the change if a motor
    moves and cannot be stopped, because the change could make it faster.

    :param at_most: the value that may be returned smaller, such as a velocity that the controller rounds.
    """
    axis.trial.depends_on(Cause(setting, SHARED))
    _come_to_rest(axis)
    placed = placed_set(axis, setting)
    before = placed.read(axis.trial)
    wanted = {**before, **values}
    placed.undo(axis.trial, before)
    placed.write(axis.trial, wanted)
    came = placed.ask(axis.trial)
    told = placed.values(came)
    lower = at_most and 0 < told[at_most] <= wanted[at_most]
    wrote = ", ".join(f"{name} = {value}" for name, value in values.items())
    says = ", ".join(f"{name} = {told[name]}" for name in values)
    due = {**wanted, at_most: told[at_most]} if lower else wanted
    axis.trial.need(
        told == due,
        f"{axis.text}: {setting} wrote {wrote}, but {placed.set.get} then returned {says}; "
        "nothing was moved",
        rule=rule_of_set(setting),
        cause=placed.differing(told, due),
        because=(Cause(setting, EFFECT),),
        wanted=placed.expected(axis.trial, wanted, came),
        came=came.raw,
    )


def shift_counter(axis: Axis, shift: int) -> None:
    """Add to the position counter of a motor at rest, and to its range, until the end of the check.

    End the check if the controller does not set the counter, or if it then moves the motor. In the second
    case, and if the check is interrupted before the status arrives, the counter is not set again.
    """
    placed = placed_set(axis, "MOT_SET_POSCOUNTER")
    _come_to_rest(axis)
    before = axis.status().position
    shifted = rests = False

    def put_back() -> None:
        due = axis.status().position - shift if shifted else before
        if rests:
            placed.write(axis.trial, {"position": due})
            _shift_range(axis, -shift if shifted else 0)
        if abs(axis.status().position - due) > HELD:
            raise StagewireError(
                f"{axis.text}: send MOT_SET_POSCOUNTER with position={due} while it rests, or home it"
            )

    axis.trial.undo(f"position counter of {axis.text}", put_back, rule=rule_of_set(placed.set.set))
    axis.trial.line.suspect(axis.place, axis.channel)
    placed.write(axis.trial, {"position": before + shift})
    try:
        came = axis.status()
    except EnoughError:
        rests = True  # nothing shows that it moves
        raise
    if came.moving:
        axis.halt()
    axis.trial.need(
        not came.moving,
        f"{axis.text}: it moves after {placed.set.set}, which should only set the counter",
        rule=rule_of_set(placed.set.set),
        cause=Cause(placed.set.set, EFFECT),
        came=came.heard.raw,
    )
    rests = True
    axis.trial.need(
        abs(came.position - before - shift) <= HELD,
        f"{axis.text}: {placed.set.set} wrote position = {before + shift}, but {came.heard.name} then "
        f"returned {came.position}; nothing was moved",
        rule=rule_of_set(placed.set.set),
        cause=Cause(placed.set.set, EFFECT),
        came=came.heard.raw,
    )
    shifted = True  # until here, the motor is where it was before
    _shift_range(axis, shift)


def _shift_range(axis: Axis, by: int) -> None:
    axis.low, axis.high, axis.start = axis.low + by, axis.high + by, axis.start + by


def _come_to_rest(axis: Axis) -> None:
    """Let all motors come to rest, and drop their end messages; end the check if one does not rest."""
    if not axis.trial.line.come_to_rest():
        raise EnoughError
    drop_ends(axis)


def placed_set(axis: Axis, setting: str) -> PlacedSet:
    """Return a parameter set of a motor, by the name of its SET."""
    sets = parameter_sets(axis.trial.declared, axis.place)
    return PlacedSet(axis.place, axis.channel, next(each for each in sets if each.set == setting))


def let_ends_be_reported(axis: Axis) -> None:
    """Write back the parameters that a motor must receive before it reports the end of any motion.

    The labjacks need their home parameters once (Issue 37, page 41). Their values are not changed.
    """
    required = axis.place.unit.reports_ends_after
    motor = (axis.place.address, axis.channel)
    if required is None or required.set is None or motor in axis.trial.line.reporting:
        return
    name = required.set.layout.message
    if name in axis.place.messages:
        placed = placed_set(axis, name)
        placed.write(axis.trial, placed.read(axis.trial))
        axis.trial.line.reporting.add(motor)


def jog_single_steps(steps: Mapping[Axis, int]) -> None:
    """Make each jog a single step of some counts."""
    for axis, step in steps.items():
        mode = int(JogMode.SINGLE_STEP)
        change(axis, "MOT_SET_JOGPARAMS", jog_mode=mode, jog_step_size=step)


def switch_backlash_off(axis: Axis) -> None:
    """Make moves end in the direction in which they began."""
    if axis.backlash:
        change(axis, "MOT_SET_GENMOVEPARAMS", backlash_distance=0)
        axis.backlash = 0


def keep_backlash_inside(axis: Axis) -> None:
    """Switch the backlash correction off if it could make a motor leave its range on the way back.

    End the check if this is not allowed.
    """
    if axis.can_return_to(axis.start):
        return
    if not axis.trial.allowed.settings or "MOT_SET_GENMOVEPARAMS" not in axis.place.messages:
        axis.trial.inconclusive(
            f"{axis.text} is at {axis.start} counts; there, the correction of its backlash "
            f"of {axis.backlash} counts would leave {axis.low}..{axis.high}; allow a wider "
            "range, or settings, so that it can be switched off"
        )
        raise EnoughError
    switch_backlash_off(axis)

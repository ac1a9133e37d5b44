"""Parameters that a moving check changes for itself, and puts back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stagewire_conformance.device.checks.apt.settings.sets import Spot, Values, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.motion.axis import Axis


def present(axis: Axis, setting: str) -> Values:
    """Return the values of a parameter set, by the name of its SET."""
    return _spot(axis, setting).read(axis.trial)


def change(axis: Axis, setting: str, *, at_most: str = "", **values: Any) -> None:
    """Change values of a parameter set until the end of the check, and see that they are there.

    The check ends where they are not: what it would do then, nobody can tell.

    :param at_most: the value that may come back smaller, such as a velocity that the controller rounds.
    """
    spot = _spot(axis, setting)
    before = spot.read(axis.trial)
    wanted = {**before, **values}
    axis.trial.undo(f"{setting} at {axis.text}", lambda: spot.put_back(axis.trial, before))
    spot.write(axis.trial, wanted)
    came = spot.ask(axis.trial)
    told = spot.values(came)
    lower = at_most and 0 < told[at_most] <= wanted[at_most]
    wrote = ", ".join(f"{name} = {value}" for name, value in values.items())
    says = ", ".join(f"{name} = {told[name]}" for name in values)
    axis.trial.need(
        told == ({**wanted, at_most: told[at_most]} if lower else wanted),
        f"{axis.text}: {setting} wrote {wrote}, and {spot.set.get} then said {says}; so nothing was moved",
        wanted=spot.expected(axis.trial, wanted, came),
        came=came.raw,
    )


def _spot(axis: Axis, setting: str) -> Spot:
    sets = parameter_sets(axis.trial.declared, axis.place)
    return Spot(axis.place, axis.channel, next(each for each in sets if each.set == setting))

"""How a motion changes with a parameter: a search for a value that is low enough to have an effect.

The unit of a velocity or acceleration may be unknown, so one measurement decides nothing. The
ratio of two does: a motion at a constant speed has a quarter of the speed with a quarter of the
velocity, and a motion that only speeds up and slows down takes twice as long with a quarter of the
acceleration. A value may be too high to matter, so it is divided by four until two successive measurements
have that ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.parameters import change, present

DIVISOR: Final = 4
"""The ratio of successive values."""
_MOST: Final = 7
"""The maximum number of values that are tried."""
_ENOUGH: Final = 5
"""The number of values with which even the effect of a low value must show: it was divided by 256."""


@dataclass(frozen=True)
class Law:
    """How a measurement depends on a parameter.

    :param setting: the message that sets it.
    :param name: its field.
    :param low: the minimum ratio of successive measurements, the later one to the earlier one.
    :param high: the maximum such ratio.
    :param measured: what is measured, for sentences, with the measurement in braces.
    :param should: the consequence that the document demands, for sentences.
    """

    setting: str
    name: str
    low: float
    high: float
    measured: str
    should: str


def velocity_law(setting: str, name: str, what: str) -> Law:
    """Return the law of a maximum velocity.

    :param what: the motion, for sentences: ``a move``.
    """
    return Law(
        setting,
        name,
        low=0.15,
        high=0.4,
        measured=f"{what} reached {{:.0f}} counts/s",
        should=f"a quarter of {name} should give a quarter of the speed",
    )


def acceleration_law(setting: str, name: str, what: str) -> Law:
    """Return the law of an acceleration."""
    return Law(
        setting,
        name,
        low=1.55,
        high=2.7,
        measured=f"{what} took {{:.2f}} s",
        should=f"with a quarter of {name}, it should take twice as long once it only speeds up and "
        "slows down",
    )


@dataclass
class Search:
    """The values that were tried for one motor.

    :param values: the values.
    :param found: the measurements with them.
    """

    values: list[int] = field(default_factory=list)
    found: list[float] = field(default_factory=list)

    def obeys(self, law: Law) -> bool:
        """Return whether the last two measurements have the ratio of a law."""
        if len(self.found) < 2:
            return False
        return law.low <= self.found[-1] / max(self.found[-2], 1e-6) <= law.high


Measure = Callable[[Sequence[Axis]], Mapping[Axis, float]]
"""Moves motors together, and returns a measurement for each that moved as it should."""


def search(axes: Sequence[Axis], law: Law, measure: Measure) -> dict[Axis, Search]:
    """Lower a parameter of each motor until its effect shows, and report each motor without the effect.

    Return the searches of the motors that show it; the last value of each stays set.
    """
    going = {axis: Search([present(axis, law.setting)[law.name]]) for axis in axes}
    obeying: dict[Axis, Search] = {}
    for number in range(_MOST):
        if number:
            going = {axis: each for axis, each in going.items() if _lower(axis, law, each)}
        found = measure(list(going)) if going else {}
        for axis in found:
            going[axis].found.append(found[axis])
        obeying |= {axis: each for axis, each in going.items() if each.obeys(law)}
        going = {
            axis: each for axis, each in going.items() if axis in found.keys() - obeying.keys()
        }
    for axis, each in going.items():
        _report(axis, law, each)
    return obeying


def _lower(axis: Axis, law: Law, each: Search) -> bool:
    """Set the next value; return whether there is one."""
    value = each.values[-1] // DIVISOR
    if value < 1 and len(each.values) >= _ENOUGH:
        _report(axis, law, each)
        return False
    if value < DIVISOR and len(each.values) < _ENOUGH:
        axis.trial.inconclusive(
            f"{axis.text}: {law.name} is only {each.values[-1]}, too low to show its effect"
        )
        return False
    change(axis, law.setting, at_most=law.name, **{law.name: value})
    each.values.append(present(axis, law.setting)[law.name])
    return True


def _report(axis: Axis, law: Law, each: Search) -> None:
    pairs = ", ".join(
        f"with {law.name} = {value}, {law.measured.format(found)}"
        for value, found in zip(each.values, each.found, strict=True)
    )
    axis.trial.must(
        False,
        f"{axis.text}: {pairs}; {law.should}",
        rule=rule_of_set(law.setting),
        cause=Cause(law.setting, law.name),
    )

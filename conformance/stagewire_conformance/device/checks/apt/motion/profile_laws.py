"""How a motion changes with a parameter: a search for a value that is low enough to have an effect.

The unit of a velocity or acceleration may be unknown, so one measurement decides nothing. The
ratio of two does: a motion at a constant speed has a quarter of the speed with a quarter of the
velocity, and a motion that only speeds up and slows down takes twice as long with a quarter of the
acceleration. A value may be too high to matter, so it is divided by four until two successive measurements
have that ratio. A :class:`Profile` has the parameters of a kind of motion, and searches both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import ProfileMode
from stagewire_conformance.device.causes import SHARED, Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.motion.apart import rule_of_apart
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.parameters import change, present
from stagewire_conformance.device.checks.apt.motion.shuttle import Shuttle

DIVISOR: Final = 4
"""The ratio of successive values."""
_MOST: Final = 7
"""The maximum number of values that are tried."""
_APART: Final = 0.6
"""The ratio of the values of successive motors."""
_ALIKE: Final = 1.2
"""The ratio of two measurements up to which they are alike."""
_DIFFERENT: Final = 1.5
"""The ratio of two values from which they differ."""
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


@dataclass(frozen=True)
class Profile:
    """The parameters of a kind of motion.

    :param what: the motion, for sentences.
    :param setting: the message that sets its parameters.
    :param velocity: the field with the maximum velocity.
    :param acceleration: the field with the acceleration.
    """

    what: str
    setting: str
    velocity: str
    acceleration: str

    @property
    def defect(self) -> Cause:
        """The defect that the motion does not obey its velocity."""
        return Cause(self.setting, self.velocity)

    def velocity_of(self, axis: Axis) -> int:
        """Return the present maximum velocity."""
        velocity: int = present(axis, self.setting)[self.velocity]
        return velocity

    def search_velocity(self, axes: Sequence[Axis], shuttle: Shuttle) -> dict[Axis, Search]:
        """Lower the velocity until the motors are slower."""
        law = velocity_law(self.setting, self.velocity, self.what)
        return search(axes, law, shuttle.speeds)

    def search_acceleration(self, axes: Iterable[Axis], shuttle: Shuttle) -> dict[Axis, Search]:
        """Lower the acceleration until the motions take longer."""
        law = acceleration_law(self.setting, self.acceleration, self.what)
        return search([axis for axis in axes if _is_trapezoidal(axis)], law, shuttle.durations)

    def restore_velocity(self, axis: Axis, velocity: int) -> None:
        """Set the maximum velocity to an earlier value."""
        change(axis, self.setting, at_most=self.velocity, **{self.velocity: velocity})

    def differ(self, axes: Sequence[Axis], name: str) -> None:
        """Give each of several motors another value of a parameter, lower than that of the one before."""
        for number, axis in enumerate(axes[1:], start=1):
            value = int(present(axis, self.setting)[name] * _APART**number)
            change(axis, self.setting, at_most=name, **{name: max(1, value)})

    def judge_apart(
        self, found: Mapping[Axis, Search], name: str, measured: Mapping[Axis, float]
    ) -> bool:
        """Report motors that do the same with different values; return whether each uses its own.

        Motors of one check are declared alike, so a value has the same unit for all of them.

        :param measured: a measurement for each motor that is proportional to the parameter.
        """
        for first, other in pairwise(found):
            values = found[first].values[-1], found[other].values[-1]
            alike = abs(math.log(measured[first] / measured[other])) <= math.log(_ALIKE)
            apart = abs(math.log(values[0] / values[1])) >= math.log(_DIFFERENT)
            if not first.trial.must(
                not (alike and apart),
                f"{self.setting} set {name} = {values[0]} of {first.text} and {values[1]} of {other.text}, "
                f"but {self.what} of both was alike: {measured[first]:.0f} and {measured[other]:.0f} counts/s"
                f"{'²' if name == self.acceleration else ''}; each should use its own value",
                rule=rule_of_apart(first, other),
                cause=Cause(self.setting, SHARED),
                because=(Cause(self.setting, name),),
            ):
                return False
        return True


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

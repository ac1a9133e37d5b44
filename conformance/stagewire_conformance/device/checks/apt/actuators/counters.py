"""``actuator-counter``: the position counter of an inertial drive can be set."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, SHARED, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator
from stagewire_conformance.device.checks.apt.actuators.actuator_check import actuator_check
from stagewire_conformance.device.checks.apt.actuators.families import CUBE, family_of, sets_of

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_COUNTERS: Final = "PZMOT_POSCOUNTERS"
_SET: Final = "PZMOT_SET_POSCOUNTERS"
_SHIFT: Final = 70_000
"""Counts of the change: more than two bytes can hold."""

COUNTER = Kind(
    name="actuator-counter",
    title="The position counter of an inertial drive can be set",
    rules=("unit-messages", "pzmot-channels"),
)


@actuator_check(
    COUNTER,
    "The position counter of {actuator} can be set, and no other counter changes",
    messages=lambda family: (_SET,),
    does="sets the position counter of each inertial drive for a moment, and restores it; nothing moves",
    reads=lambda family: (_COUNTERS,),
    writes=lambda family: (_COUNTERS,),
    changes=True,
    seconds=0.4,
    fits=lambda place: family_of(place) is CUBE,
)
def _counter(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    others = actuator.others()
    [placed] = sets_of(trial.declared, place, channel, _COUNTERS)
    values = placed.read(trial)
    placed.undo(trial, values)
    value = actuator.start + _SHIFT
    placed.write(trial, {**values, "position": value})
    now = actuator.position()
    trial.must(
        now == value,
        f"{actuator.text}: {_SET} wrote position = {value}, but it is then at {now} (before: "
        f"{actuator.start})",
        rule="unit-messages",
        cause=Cause(_SET, EFFECT),
    )
    for other, at in actuator.others().items():
        trial.must(
            at == others[other],
            f"{actuator.text}: {_SET} wrote position = {value}, and also changed the counter of channel "
            f"{other} from {others[other]} to {at}",
            rule=actuator.family.rules.channel,
            cause=Cause(_SET, SHARED),
        )

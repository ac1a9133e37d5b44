"""``piezo-limit``: the maximum voltage of an output can be lowered (pages 115, 121 and 224).

The output scales with the maximum, so it is 0 V during the check. The maximum is only lowered, and restored
at the end: a higher one could damage the actuator.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.outputs.output_check import lacks_volts, output_check
from stagewire_conformance.device.checks.apt.outputs.piezo import OPEN, Piezo
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_LIMITS: Final[Mapping[str, Mapping[str, tuple[int, ...]]]] = {
    "PZ_SET_TPZ_IOSETTINGS": {"voltage_limit": (1, 2, 3)},
    "KPC_SET_IOSETTINGS": {"voltage_limit": (75, 100, 150), "voltage_range": (75, 150)},
    "PZ_SET_OUTPUTMAXVOLTS": {"voltage": (750, 1000, 1500)},
}
"""The settings of a maximum voltage, with the values to choose from."""

_MESSAGES: Final = (
    "PZ_SET_OUTPUTVOLTS",
    "PZ_REQ_OUTPUTVOLTS",
    "PZ_GET_OUTPUTVOLTS",
    "PZ_REQ_POSCONTROLMODE",
    "PZ_GET_POSCONTROLMODE",
    "HW_START_UPDATEMSGS",
    "HW_STOP_UPDATEMSGS",
    "PZ_GET_PZSTATUSUPDATE",
)

KIND = Kind(
    name="piezo-limit",
    title="The maximum voltage of an output can be lowered",
    rules=(
        "output-volts",
        "tpz-io-settings",
        "tpz-voltage-limits",
        "max-voltage",
        "max-voltage-range",
    ),
)


def _settings(place: Target) -> tuple[str, ...]:
    return tuple(name for name in _LIMITS if name in place.listed)


@output_check(
    KIND,
    "The maximum voltage of {output} can be lowered",
    messages=_MESSAGES,
    does="sets the output of each piezo to 0 V, lowers its maximum voltage, and restores both",
    settings=True,
    lacks=lacks_volts,
    also=_settings,
    fits=_settings,
)
def _run(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, where its output is not 0 V")
    before = piezo.volts
    low, high = piezo.span("output_volts")
    if not low <= 0 <= high or not low <= before <= high:
        piezo.give_up(
            f"{piezo.text}: the check outputs 0 V; allow a range that includes it and the set voltage"
        )
    lower = [(placed, field, value) for placed, field, value in _lower(trial, place, channel)]
    if not lower:
        trial.info(f"{piezo.text} has the lowest maximum voltage, so it was not changed")
        return
    piezo.begin()
    trial.undo(
        f"output voltage of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputVolts(channel, before)),
        moves=True,
    )
    for placed in {id(one): one for one, _, _ in lower}.values():
        values = placed.read(trial)
        trial.undo(f"{placed.set.set} at {placed.text}", partial(placed.put_back, trial, values))
    piezo.send(m.PzSetOutputVolts(channel, 0))
    if not piezo.judge_seen("voltage", 0, "PZ_SET_OUTPUTVOLTS 0"):
        return
    for placed, field, value in lower:
        name = placed.set.set
        placed.write(trial, {**placed.read(trial), field: value})
        now = placed.read(trial)[field]
        trial.must(
            now == value,
            f"{piezo.text}: {name} wrote {field} = {value}, but {placed.set.get} then returned {now}",
            rule=rule_of_set(name),
            cause=Cause(name, EFFECT),
        )
        piezo.judge_seen("voltage", 0, f"{name} with {field} = {value}")


def _lower(trial: Trial, place: Target, channel: int) -> Iterator[tuple[PlacedSet, str, int]]:
    """Yield each setting with the highest value below the present one."""
    for one in parameter_sets(trial.declared, place):
        if one.skip or one.set not in _LIMITS:
            continue
        placed = PlacedSet(place, channel, one)
        values = placed.read(trial)
        for field, choice in _LIMITS[one.set].items():
            below = [value for value in choice if value < values[field]]
            if below:
                yield placed, field, max(below)

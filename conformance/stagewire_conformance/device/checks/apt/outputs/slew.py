"""``piezo-slew``: the output voltage changes no faster than the slew rate that is set (page 123)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import lacks_volts, output_check
from stagewire_conformance.device.checks.apt.outputs.piezo import FULL_SCALE, HELD, OPEN, Piezo
from stagewire_conformance.device.checks.apt.settings.sets import Spot, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Target
    from stagewire_conformance.device.trial import Trial


_SETTING: Final = "PZ_SET_TPZ_SLEWRATES"
_SLOWEST: Final = 1
"""The slowest rate; 0 would be no limit at all."""
_SHARE: Final = 19_000
"""A rate of this value is the maximum voltage in a millisecond."""


KIND = Kind(
    name="piezo-slew",
    title="The output changes no faster than the slew rate that is set",
    rules=("slew-rates", "slew-rate-limits", "output-volts"),
)


@output_check(
    KIND,
    "The output of {} changes no faster than PZ_SET_TPZ_SLEWRATES says",
    messages=(
        _SETTING,
        "PZ_REQ_TPZ_SLEWRATES",
        "PZ_GET_TPZ_SLEWRATES",
        "PZ_SET_OUTPUTVOLTS",
        "PZ_REQ_OUTPUTVOLTS",
        "PZ_GET_OUTPUTVOLTS",
        "PZ_REQ_POSCONTROLMODE",
        "PZ_GET_POSCONTROLMODE",
        "HW_START_UPDATEMSGS",
        "HW_STOP_UPDATEMSGS",
        "PZ_GET_PZSTATUSUPDATE",
    ),
    does="sets the slowest slew rate, changes the output voltage of each piezo by less than 5 % within "
    "{}, and puts both back",
    settings=True,
    lacks=lacks_volts,
    seconds=1.5,
)
def _run(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, which has a slew rate of its own")
    before = piezo.volts
    target = before + piezo.step(before, piezo.span("output_volts"))
    spot = Spot(
        place, channel, next(s for s in parameter_sets(trial.declared, place) if s.set == _SETTING)
    )
    rates = spot.read(trial)
    piezo.begin()
    trial.undo(
        f"output voltage of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputVolts(channel, before)),
        moves=True,
    )
    trial.undo(f"{_SETTING} at {piezo.text}", partial(spot.put_back, trial, rates))
    spot.write(trial, {**rates, "slew_open": _SLOWEST})
    piezo.status()
    told = trial.line.now
    piezo.send(m.PzSetOutputVolts(channel, target))
    per_second = _SLOWEST * 1000 * FULL_SCALE / _SHARE
    while True:
        status = piezo.status()
        gone = abs(status.voltage - before)
        if gone >= abs(target - before) - HELD:
            break
        if status.time - told > 2 * abs(target - before) / per_second + 1:
            break
    seconds = status.time - told
    trial.must(
        gone <= per_second * seconds + HELD,
        f"{piezo.text}: with slew_open = {_SLOWEST} the output went {gone} counts in {seconds:.2f} s; "
        f"it should take {abs(target - before) / per_second:.2f} s",
        came=status.heard.raw,
    )
    piezo.judge_seen("voltage", target, f"PZ_SET_OUTPUTVOLTS {target}")

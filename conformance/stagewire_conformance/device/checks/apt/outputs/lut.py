"""``piezo-lut``: a waveform is put out from its start to its stop, and not before (pages 106 to 112).

Two samples near to the present output, each held for a quarter of a second. Nobody can ask for the samples
that are in the table (its request names none), so that those two are lost; that is said before.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.errors import UnknownScaleError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import LutValueType
from stagewire_apt.flags import LutOutputMode
from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks.apt.outputs.making import lacks_unit, output_checks
from stagewire_conformance.device.checks.apt.outputs.piezo import OPEN, Piezo
from stagewire_conformance.device.checks.apt.settings.sets import Spot, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared, Place
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

__all__ = ["KIND"]

_MESSAGES: Final = (
    "PZ_START_LUTOUTPUT",
    "PZ_STOP_LUTOUTPUT",
    "PZ_SET_OUTPUTLUT",
    "PZ_REQ_OUTPUTLUT",
    "PZ_GET_OUTPUTLUT",
    "PZ_SET_OUTPUTLUTPARAMS",
    "PZ_REQ_OUTPUTLUTPARAMS",
    "PZ_GET_OUTPUTLUTPARAMS",
    "PZ_REQ_POSCONTROLMODE",
    "PZ_GET_POSCONTROLMODE",
    "PZ_REQ_OUTPUTVOLTS",
    "PZ_GET_OUTPUTVOLTS",
    "HW_START_UPDATEMSGS",
    "HW_STOP_UPDATEMSGS",
    "PZ_GET_PZSTATUSUPDATE",
)
_HOLD: Final = 0.25
"""Seconds that a sample is held."""
_LOOKS: Final = 8
"""Status messages in which both samples have to be seen: a second and a half of them."""


def _run(trial: Trial, place: Place, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop; samples would be positions there")
    present = piezo.volts
    step = piezo.step(present, piezo.span("output_volts"), steps=2)
    samples = (present + step, present + 2 * step)
    _load(piezo, samples)
    piezo.begin()
    trial.undo(
        f"waveform of {piezo.text}",
        lambda: piezo.send(m.PzStopLutOutput(channel)),
    )
    near = abs(step) // 4

    def told() -> set[int]:
        """Return which of the samples are put out, watched for a while; 0 is none of them."""
        seen = [piezo.status().voltage for _ in range(_LOOKS)]
        return (
            {next((s for s in samples if abs(v - s) <= near), 0) for v in seen} if seen else set()
        )

    first = piezo.status()
    trial.must(
        all(abs(first.voltage - sample) > near for sample in samples),
        f"{piezo.text}: a waveform was loaded and not started, and {first.heard.name} says a voltage of "
        f"{first.voltage}; it should be {present} until PZ_START_LUTOUTPUT",
        came=first.heard.raw,
    )
    piezo.send(m.PzStartLutOutput(channel))
    missing = set(samples) - told()
    trial.must(
        not missing,
        f"{piezo.text}: PZ_START_LUTOUTPUT was sent, and of the samples {samples[0]} and {samples[1]} "
        f"{' and '.join(map(str, sorted(missing)))} never came out",
    )
    piezo.send(m.PzStopLutOutput(channel))
    piezo.status()
    after = [piezo.status() for _ in range(_LOOKS)]
    volts = [status.voltage for status in after]
    trial.must(
        max(volts) - min(volts) <= near,
        f"{piezo.text}: PZ_STOP_LUTOUTPUT was sent, and the output went on between {min(volts)} and "
        f"{max(volts)}",
        came=after[-1].heard.raw,
    )


def _load(piezo: Piezo, samples: tuple[int, int]) -> None:
    """Load the samples, and how they are put out; both is put back as far as it can be asked for."""
    trial, channel = piezo.trial, piezo.channel
    sets = {one.set: one for one in parameter_sets(trial.declared, piezo.place)}
    for name in ("PZ_SET_OUTPUTLUTPARAMS", "PZ_SET_OUTPUTLUT"):
        spot = Spot(piezo.place, channel, sets[name])
        before = spot.read(trial)
        trial.undo(f"{name} at {spot.text}", partial(spot.put_back, trial, before))
    if "PZ_SET_LUTVALUETYPE" in piezo.place.messages:
        piezo.send(m.PzSetLutValueType(LutValueType.VOLTAGE))
    for index, sample in enumerate(samples):
        piezo.send(m.PzSetOutputLut(channel, index, sample))
    parameters = m.PzSetOutputLutParams(
        chan_ident=channel,
        mode=LutOutputMode.of(outputlut_continuous=True),
        cycle_length=len(samples),
        num_cycles=1,
        delay_time=max(1, round(_HOLD * 1000 / _interval(piezo))),
        pre_cycle_rest=0,
        post_cycle_rest=0,
        op_trig_start=0,
        op_trig_width=1,
        trig_repeat_cycle=0,
    )
    piezo.send(parameters)
    now = piezo.ask(m.PzReqOutputLutParams(channel))
    trial.need(
        now.values() == parameters.values(),
        f"{piezo.text}: PZ_SET_OUTPUTLUTPARAMS was sent, and PZ_GET_OUTPUTLUTPARAMS then said {now!r}; "
        "so nothing "
        "was put out",
    )


def _interval(piezo: Piezo) -> float:
    """Return the milliseconds of a sample interval (page 109); 1 where none is known."""
    scales = piezo.place.connected_to(piezo.channel).scales
    try:
        return float(scales.of("lut_samples", "ms").from_counts(1))
    except UnknownScaleError:
        return 1.0


def _make(declared: Declared, allowed: Permissions) -> Iterator[Check]:
    return output_checks(
        declared,
        "piezo-lut",
        title="A waveform of {} is put out from PZ_START_LUTOUTPUT to PZ_STOP_LUTOUTPUT",
        messages=_MESSAGES,
        run=_run,
        does="loads two samples of the waveform table of each piezo, which nobody can read and put "
        "back, and puts "
        f"them out for a second, near to the present output and within {allowed.motion}",
        settings=True,
        lacks=lambda place: lacks_unit(allowed, ("V", "mV"), "voltages"),
        seconds=2.5,
    )


KIND = Kind(
    name="piezo-lut",
    title="A waveform is put out from its start to its stop",
    rules=(
        "lut-waveform",
        "lut-partial",
        "lut-subset",
        "lut-continuous",
        "lut-waits-for-start",
        "lut-start",
        "lut-stop",
    ),
    make=_make,
)

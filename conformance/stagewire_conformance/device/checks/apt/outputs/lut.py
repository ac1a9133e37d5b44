"""``piezo-lut``: a waveform is output from start to stop, and not before (pages 106 to 112).

The waveform has two samples close to the current output, each held for a while. It is output continuously,
and then once with rests before and after it. The samples in the table cannot be read, because the request
does not select one. So the first two are lost; the description shown before the run says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.errors import UnknownScaleError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import LutValueType
from stagewire_apt.flags import LutOutputMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import lacks_volts, output_check
from stagewire_conformance.device.checks.apt.outputs.piezo import OPEN, Piezo
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_MESSAGES: Final = (
    "PZ_START_LUTOUTPUT",
    "PZ_STOP_LUTOUTPUT",
    "PZ_SET_OUTPUTLUT",
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
_HOLD: Final = 0.2
"""Seconds for which a sample is held: two status messages."""
_REST: Final = 0.6
"""Seconds of the rests before and after a cycle."""
_OFF: Final = 0.3
"""Tolerance in seconds of the observed length of a phase: three status messages."""
_CHANGES: Final = 5
"""Phases after which more than two cycles were observed."""
_PATIENCE: Final = 3.0
"""Seconds within which these phases must be observed."""
_AFTER: Final = 0.5
"""Seconds after a stop, or after the end, in which the output may not change: more than two samples take."""


@dataclass
class _Phase:
    """A time in which one sample was output.

    :param sample: the sample; 0 if the output was neither of them.
    :param began: when it was first seen, in seconds since the line was opened.
    :param ended: when it was last seen.
    """

    sample: int
    began: float
    ended: float


@dataclass(frozen=True)
class _Waveform:
    """The two samples of a waveform, and the piezo that outputs it."""

    piezo: Piezo
    samples: tuple[int, int]

    @property
    def near(self) -> int:
        """The tolerance of a sample in counts."""
        return abs(self.samples[1] - self.samples[0]) // 4

    def sample_of(self, voltage: int) -> int:
        """Return the sample that is being output; 0 if it is neither of them."""
        return next((each for each in self.samples if abs(voltage - each) <= self.near), 0)

    def watch(self, changes: int) -> list[_Phase]:
        """Return the phases of the output until so many were observed, or time runs out."""
        phases: list[_Phase] = []
        end = self.piezo.trial.line.now + _PATIENCE
        while len([phase for phase in phases if phase.sample]) < changes:
            status = self.piezo.status()
            sample = self.sample_of(status.voltage)
            if not phases or phases[-1].sample != sample:
                phases.append(_Phase(sample, status.time, status.time))
            phases[-1].ended = status.time
            if status.time > end:
                break
        return phases

    def judge_still(self, after: str) -> None:
        """Report an output that changes after the waveform has ended."""
        line = self.piezo.trial.line
        self.piezo.status()
        end = line.now + _AFTER
        volts = [self.piezo.status().voltage]
        while line.now < end:
            volts.append(self.piezo.status().voltage)
        self.piezo.trial.must(
            max(volts) - min(volts) <= self.near,
            f"{self.piezo.text}: after {after}, the output still changed between "
            f"{min(volts)} and {max(volts)}; it should stay the same",
            rule="lut-stop",
            cause=Cause("PZ_STOP_LUTOUTPUT", EFFECT),
        )


KIND = Kind(
    name="piezo-lut",
    title="A waveform is output from start to stop",
    rules=(
        "lut-waveform",
        "lut-partial",
        "lut-subset",
        "lut-continuous",
        "lut-cycle-count-ignored",
        "lut-fixed",
        "lut-delay",
        "lut-rests",
        "lut-sampling-interval",
        "lut-waits-for-start",
        "lut-start",
        "lut-stop",
    ),
)


@output_check(
    KIND,
    "A waveform of {output} is output from PZ_START_LUTOUTPUT to PZ_STOP_LUTOUTPUT",
    messages=_MESSAGES,
    does="loads two samples into the waveform table of each piezo, whose previous samples cannot be "
    "read or restored, and outputs them for three seconds, close to the current output and "
    "within {range}",
    settings=True,
    lacks=lacks_volts,
    seconds=4.3,
)
def _run(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, where samples would be positions")
    present = piezo.volts
    step = piezo.step(present, piezo.span("output_volts"), steps=2)
    wave = _Waveform(piezo, (present + step, present + 2 * step))
    _load(wave)
    _set(piezo, LutOutputMode.of(outputlut_continuous=True))
    piezo.begin()
    trial.undo(f"waveform of {piezo.text}", lambda: piezo.send(m.PzStopLutOutput(channel)))
    first = piezo.status()
    trial.must(
        not wave.sample_of(first.voltage),
        f"{piezo.text}: a waveform was loaded but not started, and {first.heard.name} reports a "
        f"voltage of {first.voltage}; it should stay {present} until PZ_START_LUTOUTPUT",
        came=first.heard.raw,
        rule="lut-waits-for-start",
    )
    if _continuous(wave):
        _fixed(wave)


def _continuous(wave: _Waveform) -> bool:
    """Output the waveform continuously, and return whether it was observed."""
    piezo = wave.piezo
    piezo.send(m.PzStartLutOutput(piezo.channel))
    phases = wave.watch(_CHANGES)
    seen = {phase.sample for phase in phases}
    missing = [str(sample) for sample in wave.samples if sample not in seen]
    started = piezo.trial.must(
        not missing,
        f"{piezo.text}: after PZ_START_LUTOUTPUT, the output never reached "
        f"{' and '.join(missing)} of the samples {wave.samples[0]} and {wave.samples[1]}",
        rule="lut-start",
        cause=Cause("PZ_START_LUTOUTPUT", EFFECT),
    )
    told = [phase for phase in phases if phase.sample]
    if started:
        count = len(told)
        piezo.trial.must(
            count >= _CHANGES,
            f"{piezo.text}: a continuous waveform of two samples, each held for {_HOLD:g} s, "
            f"changed {count} times in {_PATIENCE:g} s; it should continue until "
            "PZ_STOP_LUTOUTPUT",
            rule="lut-continuous",
        )
    if len(told) >= _CHANGES:
        held = (told[-1].began - told[1].began) / (len(told) - 2)
        piezo.trial.must(
            abs(held - _HOLD) <= _HOLD * 0.4,
            f"{piezo.text}: each sample of a waveform was output for {held:.2f} s; with its "
            f"delay it should be {_HOLD:g} s",
            rule="lut-delay",
        )
    piezo.send(m.PzStopLutOutput(piezo.channel))
    wave.judge_still("PZ_STOP_LUTOUTPUT")
    return started


def _fixed(wave: _Waveform) -> None:
    """Output the waveform once, with rests before and after it."""
    piezo = wave.piezo
    _set(piezo, LutOutputMode.of(outputlut_fixed=True), _REST)
    piezo.send(m.PzStartLutOutput(piezo.channel))
    phases = wave.watch(len(wave.samples))
    told = [phase for phase in phases if phase.sample]
    order = [phase.sample for phase in told]
    if not piezo.trial.must(
        order == list(wave.samples),
        f"{piezo.text}: one cycle of the samples {wave.samples[0]} and {wave.samples[1]} was "
        f"started, but the output was {', '.join(map(str, order)) or 'neither'}",
        rule="lut-fixed",
    ):
        return
    due = _REST + _HOLD
    lasted = told[1].began - told[0].began
    piezo.trial.must(
        abs(lasted - due) <= _OFF,
        f"{piezo.text}: the first sample of a cycle was output for {lasted:.1f} s; a rest of "
        f"{_REST:g} s and a sample of {_HOLD:g} s make {due:g} s",
        rule="lut-rests",
    )
    piezo.trial.line.listen(due + _OFF)
    wave.judge_still("one cycle of a waveform")


def _load(wave: _Waveform) -> None:
    """Load the samples. Restore the parameters later, and the samples as far as they can be read."""
    piezo, trial = wave.piezo, wave.piezo.trial
    sets = {one.set: one for one in parameter_sets(trial.declared, piezo.place)}
    for name in sorted({"PZ_SET_OUTPUTLUTPARAMS", "PZ_SET_OUTPUTLUT"} & sets.keys(), reverse=True):
        placed = PlacedSet(piezo.place, piezo.channel, sets[name])
        before = placed.read(trial)
        trial.undo(f"{name} at {placed.text}", partial(placed.put_back, trial, before))
    if "PZ_SET_LUTVALUETYPE" in piezo.place.messages:
        piezo.send(m.PzSetLutValueType(LutValueType.VOLTAGE))
    for index, sample in enumerate(wave.samples):
        piezo.send(m.PzSetOutputLut(piezo.channel, index, sample))


def _set(piezo: Piezo, mode: int, rest: float = 0.0) -> None:
    """Set how the waveform is output; end the check if the controller does not apply it."""
    interval = _interval(piezo)
    parameters = m.PzSetOutputLutParams(
        chan_ident=piezo.channel,
        mode=mode,
        cycle_length=2,
        num_cycles=1,
        delay_time=max(1, round(_HOLD * 1000 / interval)),
        pre_cycle_rest=round(rest * 1000 / interval),
        post_cycle_rest=round(rest * 1000 / interval),
        op_trig_start=0,
        op_trig_width=1,
        trig_repeat_cycle=0,
    )
    piezo.send(parameters)
    now = piezo.ask(m.PzReqOutputLutParams(piezo.channel))
    piezo.trial.need(
        now.values() == parameters.values(),
        f"{piezo.text}: PZ_SET_OUTPUTLUTPARAMS wrote {parameters!r}, but PZ_GET_OUTPUTLUTPARAMS "
        f"then returned {now!r}; no waveform was started",
        rule="lut-parameters",
        cause=Cause("PZ_SET_OUTPUTLUTPARAMS", EFFECT),
    )


def _interval(piezo: Piezo) -> float:
    """Return the milliseconds of a sample interval (page 109); 1 if unknown."""
    scales = piezo.place.connected_to(piezo.channel).scales
    try:
        return float(scales.of("lut_samples", "ms").from_counts(1))
    except UnknownScaleError:
        return 1.0

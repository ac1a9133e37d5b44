"""The arbitrary waveform generator of a channel, with its triggers.

A :class:`Waveform` is one output of the waveform table, as a function of time (pages 106 to 111).
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from stagewire_apt.flags import LutOutputMode
from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.instrument import Unit

MILLISECOND = 1_000_000
"""Nanoseconds in a millisecond."""


def sample_interval(unit: Unit) -> Fraction:
    """Return the time between two samples in nanoseconds (page 109): 1/7 ms, 1 ms or 1/4 ms by unit.

    If the registry has no interval for the unit, it is 1 ms, as for most units.
    """
    by_unit = unit.registry["quantities"]["lut_samples"]["scale"]["units"]
    scale = by_unit.get(unit.name, {}).get("ms_per_count", {"numerator": 1, "denominator": 1})
    return Fraction(scale["numerator"], scale["denominator"]) * MILLISECOND


@dataclass(frozen=True, slots=True)
class Pulses:
    """The pulses of the trigger output within a cycle (page 110).

    :param first: the sample at which the first pulse begins; the first sample is 0 here and 1 on the wire.
    :param width: the duration of a pulse in nanoseconds. It ends with its cycle at the latest.
    :param repeat: the number of samples between the beginnings of further pulses; 0 for none.
    """

    first: int
    width: int
    repeat: int = 0


@dataclass(frozen=True, slots=True)
class Waveform:
    """Samples that are output in cycles.

    A cycle outputs its first sample for ``pre_cycle_rest``, then each sample for ``hold``, then its last one
    for ``post_cycle_rest``, all in sample intervals.

    :param table: the waveform table. Samples that are loaded during the output take effect immediately.
    :param length: the number of samples in a cycle; at least 1.
    :param cycles: the number of cycles; None for cycles without end.
    :param hold: the duration of a sample; 1 + ``delay_time`` of the message.
    :param interval: a sample interval in nanoseconds.
    :param pulses: the pulses of the trigger output; None for none.
    """

    table: Sequence[int]
    length: int
    cycles: int | None
    hold: int
    interval: Fraction
    pre_cycle_rest: int = 0
    post_cycle_rest: int = 0
    pulses: Pulses | None = None

    @property
    def cycle(self) -> int:
        """The length of a cycle, in sample intervals."""
        return self.pre_cycle_rest + self.length * self.hold + self.post_cycle_rest

    @property
    def duration(self) -> int | None:
        """The duration of all cycles in nanoseconds; None without end."""
        return None if self.cycles is None else math.ceil(self.cycles * self.cycle * self.interval)

    def sample(self, elapsed: int) -> int:
        """Return the sample that is output ``elapsed`` nanoseconds after the beginning."""
        index = math.floor(self._moment(elapsed) / self.hold)
        return self.table[min(max(index, 0), self.length - 1)]

    def pulse(self, elapsed: int) -> bool:
        """Return whether the trigger output is active ``elapsed`` nanoseconds after the beginning."""
        if self.pulses is None:
            return False
        moment = self._moment(elapsed)
        first, repeat = self.pulses.first, self.pulses.repeat
        index = min(math.floor(moment / self.hold), self.length - 1)
        if index < first:
            return False
        latest = index - (index - first) % repeat if repeat else first
        return (moment - latest * self.hold) * self.interval < self.pulses.width

    def _moment(self, elapsed: int) -> Fraction:
        """Return the time since the first sample of this cycle, in sample intervals; negative before it."""
        return elapsed / self.interval % self.cycle - self.pre_cycle_rest


_CUBES = ("piezo_cube", "piezo_kcube", "piezo_strain_gauge_kcube")
# Have a smaller table and no triggers (pages 106 and 108, which name the TPZ001).
_LAST_INDEX_OF_CUBES = 512
_LAST_INDEX = 7999


class WaveformGenerator:
    """Outputs the waveform table, immediately or controlled by the trigger input.

    The parameters at a start apply until the next start. As a trigger, the active edge of the input starts an
    armed output, once for each start. As a gate (``outputlut_lutgated``), the input lets the output continue
    while its level is active and pauses it otherwise. ``outputlut_inputtrig_sense_hi`` selects the active
    level.

    :param unit: the unit, which determines the size of the table, the sample interval and the triggers.
    :param clock: the clock.
    :param ended: called with the last sample when the last cycle is over.
    """

    def __init__(self, unit: Unit, clock: Clock, ended: Callable[[int], None]) -> None:
        self._clock = clock
        self._ended = ended
        self._interval = sample_interval(unit)
        self.has_triggers = unit.facts.get("family") not in _CUBES
        """Whether the trigger bits of the mode apply (page 108)."""
        self.last_index = _LAST_INDEX if self.has_triggers else _LAST_INDEX_OF_CUBES
        """The highest index of the table (page 106)."""
        self.table = array("h", bytes(2 * (self.last_index + 1)))
        """The samples; 0 if not loaded."""
        self._waveform: Waveform | None = None
        self._mode = LutOutputMode(0)
        self._level = False  # of the trigger input
        self._done = 0  # nanoseconds of output before the gate closed
        self._since: int | None = None  # the instant since which it is output; None while it waits
        self._timer: Timer | None = None

    def clear(self) -> None:
        """End the output, or disarm, and clear all samples."""
        self.stop()
        self.table = array("h", bytes(2 * len(self.table)))

    def start(self, parameters: Mapping[str, int]) -> str | None:
        """Start the output, or arm it, with the values of ``PZ_OUTPUTLUTPARAMS``.

        Return why it is refused, or None. A start during the output restarts it.
        """
        mode = self._mode_of(parameters)
        if not parameters["cycle_length"]:
            return "cycle_length is 0"
        if not mode.outputlut_continuous and not mode.outputlut_fixed:
            return "the mode is neither continuous nor a fixed number of cycles"
        self.stop()
        self._mode = mode
        self._waveform = Waveform(
            self.table,
            parameters["cycle_length"],
            # page 109: in continuous mode the number of cycles is ignored
            None if mode.outputlut_continuous else parameters["num_cycles"],
            1 + parameters["delay_time"],
            self._interval,
            parameters["pre_cycle_rest"],
            parameters["post_cycle_rest"],
            self._pulses(parameters),
        )
        opens = mode.outputlut_lutgated and self._input_active
        if opens or not mode.outputlut_inputtrig:
            self._go_on()
        return None

    def stop(self) -> None:
        """End the output, or disarm."""
        self._hold()
        self._waveform = None
        self._done = 0

    @property
    def armed(self) -> bool:
        """Whether it has been started and waits for its trigger."""
        return self._waveform is not None and self.sample is None

    @property
    def sample(self) -> int | None:
        """The present sample; None before the first and after the last."""
        if self._waveform is None or (self._since is None and not self._done):
            return None
        return self._waveform.sample(self._elapsed)

    @property
    def trigger_output(self) -> bool:
        """The present level of the trigger output (page 110), True for high; low if it is not used."""
        if not self._mode.outputlut_outputtrig:
            return False
        waveform = self._waveform
        active = waveform is not None and self.sample is not None and waveform.pulse(self._elapsed)
        return active == self._mode.outputlut_outputtrig_sense_hi

    @property
    def trigger_input(self) -> bool:
        """The level of the trigger input, True for high; low in a new controller."""
        return self._level

    @trigger_input.setter
    def trigger_input(self, level: bool) -> None:
        changed, self._level = level != self._level, level
        if self._waveform is None or not changed:
            return
        if self._input_active and self._since is None:
            self._go_on()
        elif self._mode.outputlut_lutgated and self._mode.outputlut_inputtrig:
            self._hold()

    def pulse_input(self) -> None:
        """Apply one active edge to the trigger input, and restore its level."""
        level, active = self._level, self._mode.outputlut_inputtrig_sense_hi
        for step in (not active, active, level):
            self.trigger_input = step

    @property
    def _input_active(self) -> bool:
        return self._level == self._mode.outputlut_inputtrig_sense_hi

    @property
    def _elapsed(self) -> int:
        going = 0 if self._since is None else self._clock.now - self._since
        return self._done + going

    def _mode_of(self, parameters: Mapping[str, int]) -> LutOutputMode:
        applies = parameters["mode"]
        if not self.has_triggers:
            applies &= LutOutputMode.outputlut_continuous | LutOutputMode.outputlut_fixed
        return LutOutputMode(applies)

    def _pulses(self, parameters: Mapping[str, int]) -> Pulses | None:
        mode = self._mode
        if not mode.outputlut_outputtrig:
            return None
        return Pulses(
            max(0, parameters["op_trig_start"] - 1),  # counted from 1 (page 110)
            parameters["op_trig_width"] * MILLISECOND,  # known for the BPC20x, assumed for all
            parameters["trig_repeat_cycle"] if mode.outputlut_outputtrig_repeat else 0,
        )

    def _go_on(self) -> None:
        self._since = self._clock.now
        duration = self._waveform.duration if self._waveform else None
        if duration is not None:
            self._timer = self._clock.call_at(self._since + duration - self._done, self._finish)

    def _hold(self) -> None:
        self._done = self._elapsed
        self._since = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _finish(self) -> None:
        waveform = self._waveform
        self.stop()
        if waveform is not None:
            self._ended(waveform.table[waveform.length - 1])

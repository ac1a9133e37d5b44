"""One output of the waveform table, as a function of time (pages 106 to 111)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from stagewire_virtual.units import Unit

__all__ = ["MILLISECOND", "Pulses", "Waveform", "sample_interval"]

MILLISECOND = 1_000_000
"""Nanoseconds in a millisecond."""


def sample_interval(unit: Unit) -> Fraction:
    """Return the time between two samples in nanoseconds (page 109): 1/7 ms, 1 ms or 1/4 ms by unit.

    A unit that the registry gives no interval has that of most, 1 ms.
    """
    by_unit = unit.registry["quantities"]["lut_samples"]["scale"]["units"]
    scale = by_unit.get(unit.name, {}).get("ms_per_count", {"numerator": 1, "denominator": 1})
    return Fraction(scale["numerator"], scale["denominator"]) * MILLISECOND


@dataclass(frozen=True, slots=True)
class Pulses:
    """When the trigger output is active within a cycle (page 110).

    :param first: the sample that begins a pulse, counted from 0 here and from 1 on the wire.
    :param width: how long a pulse lasts, in nanoseconds. It ends with its cycle at the latest.
    :param repeat: a further pulse begins with every so manieth sample after that; 0 for none.
    """

    first: int
    width: int
    repeat: int = 0


@dataclass(frozen=True, slots=True)
class Waveform:
    """Samples, put out one after the other, cycle after cycle.

    A cycle holds its first sample for ``pre_cycle_rest``, then each sample for ``hold``, then its last one
    for ``post_cycle_rest``, all counted in sample intervals.

    :param table: the waveform table. Samples that are loaded while they are put out are put out.
    :param length: how many samples of the table make a cycle; at least 1.
    :param cycles: how many cycles; None for cycles without end.
    :param hold: how long a sample lasts; 1 and the ``delay_time`` of the message.
    :param interval: a sample interval in nanoseconds.
    :param pulses: what the trigger output does; None for nothing.
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
        """How long all of it takes, in nanoseconds; None for ever."""
        return None if self.cycles is None else math.ceil(self.cycles * self.cycle * self.interval)

    def sample(self, elapsed: int) -> int:
        """Return the sample that is put out ``elapsed`` nanoseconds after the beginning."""
        index = math.floor(self._moment(elapsed) / self.hold)
        return self.table[min(max(index, 0), self.length - 1)]

    def pulse(self, elapsed: int) -> bool:
        """Say whether the trigger output is active ``elapsed`` nanoseconds after the beginning."""
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
        """Return the sample intervals since this cycle clocked out its first sample; below 0 before."""
        return elapsed / self.interval % self.cycle - self.pre_cycle_rest

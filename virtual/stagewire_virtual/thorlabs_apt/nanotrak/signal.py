"""The signal of a NanoTrak: a spot of light, and an input with ranges or an external voltage."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, NamedTuple

from stagewire.errors import BadValueError
from stagewire_virtual.instrument import Unit

FULL_RANGE: Final = 10.0
"""NanoTrak units of the whole range of an axis (page 252)."""

COUNTS: Final = 65535 / FULL_RANGE
"""Counts in a NanoTrak unit (page 252)."""

NOISE: Final = 1e-9
"""The current in A below which no signal is found: the lowest reading of pages 254 and 270."""

_VOLTS_PER_AMPERE: Final = 40_000  # of the external power meter: 4 V at the default peak

_NEAREST, _FARTHEST = 1.0, 3.0  # of a seeded spot from the middle, on each axis


@dataclass(frozen=True, slots=True)
class Spot:
    """The signal at each position of the circle.

    :param a: the horizontal position of the maximum, in NanoTrak units, 0 to 10.
    :param b: the vertical position of the maximum.
    :param width: the distance from the maximum, in NanoTrak units, at which the signal is 1/e² of it.
    :param peak: the current of the photodiode at the maximum, in A; 0 for darkness.

    Raises :class:`~stagewire.errors.BadValueError` for a value out of range.
    """

    a: float
    b: float
    width: float = 3.0
    peak: float = 100e-6

    def __post_init__(self) -> None:
        if not (0 <= self.a <= FULL_RANGE and 0 <= self.b <= FULL_RANGE):
            raise BadValueError(
                f"a spot must be from 0 to {FULL_RANGE:g} NanoTrak units, not at {self.a}, {self.b}"
            )
        if not (0 < self.width < math.inf and 0 <= self.peak < math.inf):
            raise BadValueError("a spot needs a positive width and a peak of at least 0 A")

    def current(self, a: float, b: float) -> float:
        """Return the current of the photodiode at a position, in A."""
        distance = math.hypot(a - self.a, b - self.b)
        return self.peak * math.exp(-2 * (distance / self.width) ** 2)

    def volts(self, a: float, b: float) -> float:
        """Return the voltage of the external power meter at a position."""
        return self.current(a, b) * _VOLTS_PER_AMPERE


def seeded_spot(chance: random.Random) -> Spot:
    """Return a spot at a random position that a circle in the middle of the range finds."""
    a, b = (
        FULL_RANGE / 2 + chance.choice((-1, 1)) * chance.uniform(_NEAREST, _FARTHEST)
        for _ in range(2)
    )
    return Spot(a, b)


IN_RANGE, UNDER_READ, OVER_READ = 1, 2, 3
"""The values of ``under_over_read`` (page 255)."""

UNDER: Final = 0.05
"""The share of its range below which a signal is under-reading; the document has no value."""

TIA: Final = 1
"""The value of ``feedback_src`` for the amplifier (page 272)."""

VOLTS: Final[Mapping[int, float]] = {2: 1.0, 3: 2.0, 4: 5.0, 5: 10.0}
"""The range in V of each external input (page 272)."""

_AUTO = (1, 4)  # range modes that follow the signal (page 264)
_SET = (3, 4)  # range modes that change to range_sw
_FIRST_OF_TNA001 = 5  # it lacks the ranges 1 and 2 (page 255)
_ODD = 2  # range_change_type for odd ranges (page 265)
_EVEN = 3
_RANGE_1 = 3  # the value of the first range (page 255)
_UNITS: Final[Mapping[str, float]] = {"NA": 1e-9, "UA": 1e-6, "MA": 1e-3}


class Reading(NamedTuple):
    """A reading of the input.

    :param absolute: the current in A, or the external voltage in V.
    :param share: the share of the range, 0 to 1.
    :param check: whether it is within the range: a value of ``under_over_read``.
    """

    absolute: float
    share: float
    check: int


def full_scales(unit: Unit) -> Mapping[int, float]:
    """Return the ranges of a unit: value in messages -> current at full scale in A."""
    (layout,) = unit.message("PZ_GET_NTTIAREADING")["layouts"]
    field = next(field for field in layout["fields"] if field["name"] == "range")
    table = field["enums_by_unit"].get(unit.name, field["enumeration"])
    first = _FIRST_OF_TNA001 if unit.name == "TNA001" else 0
    values = unit.registry["enumerations"][table]["values"]
    found = {entry["value"]: _amperes(name) for name, entry in values.items()}
    return {value: found[value] for value in sorted(found) if value >= first}


def _amperes(name: str) -> float:
    """Return the current in the name of a range, such as RANGE_16P6NA."""
    match = re.fullmatch(r"RANGE_(\d+)(?:P(\d+))?([NUM]A)", name)
    assert match, name
    return float(Fraction(f"{match[1]}.{match[2] or 0}")) * _UNITS[match[3]]


class Amplifier:
    """The amplifier, whose range is fixed or follows the signal.

    The range changes within a revolution of the circle, so ``settle_samples``, at most 32 of 7000 in a
    second, is stored but has no effect.

    :param unit: the unit, which determines the ranges.
    """

    def __init__(self, unit: Unit) -> None:
        self.ranges = full_scales(unit)
        """Value of each range -> current at full scale in A."""
        self.range = max(self.ranges)
        """The value of the present range."""
        self._automatic = False
        self._limits = (0.0, 1.0)
        self._steps = 1

    @property
    def automatic(self) -> bool:
        """Whether the range follows the signal."""
        return self._automatic

    def configure(self, values: Mapping[str, int], *, power_on: bool = False) -> None:
        """Apply the values of ``PZ_NTTIARANGEPARAMS``; at power-on, the range is always ``range_sw``."""
        self._automatic = values["range_mode"] in _AUTO
        self._limits = values["range_down_limit"] / 1000, values["range_up_limit"] / 1000
        self._steps = values["range_change_type"]
        if (power_on or values["range_mode"] in _SET) and values["range_sw"] in self.ranges:
            self.range = values["range_sw"]

    def follow(self, current: float) -> None:
        """Choose the range for a current, if the range follows the signal."""
        if not self._automatic:
            return
        used = [value for value in self.ranges if self._visits(value)]
        down, up = self._limits
        while current > up * self.ranges[self.range]:
            higher = [value for value in used if value > self.range]
            if not higher:
                return
            self.range = higher[0]
        while current < down * self.ranges[self.range]:
            lower = [value for value in used if value < self.range]
            if not lower or current > up * self.ranges[lower[-1]]:
                return
            self.range = lower[-1]

    def _visits(self, value: int) -> bool:
        """Return whether automatic ranging uses a range: all, those with an odd or an even number."""
        odd = (value - _RANGE_1) % 2 == 0
        return {_ODD: odd, _EVEN: not odd}.get(self._steps, True)

    def read(self, current: float) -> Reading:
        """Return the reading of a current."""
        return reading(current, self.ranges[self.range])


def reading(signal: float, full_scale: float) -> Reading:
    """Return the reading of a signal in a range; beyond full scale, it is full scale."""
    share = signal / full_scale
    check = OVER_READ if share > 1 else UNDER_READ if share < UNDER else IN_RANGE
    return Reading(min(signal, full_scale), min(share, 1.0), check)

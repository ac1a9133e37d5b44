"""Temperature sensors: transducers, which report degrees, and thermistors, which report kilohms."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from stagewire_apt.enumerations import TecSensor
from stagewire_virtual.instrument import Unit

B_VALUE: Final = 3900.0
"""The B value of a thermistor in kelvins; our choice."""

_ZERO: Final = 273.15
_NOMINAL: Final = 25.0 + _ZERO
_SMALLEST: Final = 0.01  # kOhm: one count


class Sensor(NamedTuple):
    """A sensor, whose counts are hundredths of a degree Celsius or of a kilohm (page 356).

    :param name: its name in the registry.
    :param minimum: its lowest count.
    :param maximum: its highest count.
    :param kilohms: its resistance at 25 degrees Celsius; None for a transducer.
    """

    name: str
    minimum: int
    maximum: int
    kilohms: float | None = None

    def counts(self, temperature: float) -> int:
        """Return the counts at a temperature in degrees Celsius, or the nearest count of the range."""
        value = temperature
        if self.kilohms is not None:
            value = self.kilohms * math.exp(B_VALUE * (1 / (temperature + _ZERO) - 1 / _NOMINAL))
        return self.nearest(round(value * 100))

    def temperature(self, counts: int) -> float:
        """Return the temperature in degrees Celsius for some counts."""
        if self.kilohms is None:
            return counts / 100
        value = max(counts / 100, _SMALLEST)
        return 1 / (1 / _NOMINAL + math.log(value / self.kilohms) / B_VALUE) - _ZERO

    def nearest(self, counts: int) -> int:
        """Return the nearest count of the range."""
        return min(max(counts, self.minimum), self.maximum)

    def fault(self, counts: int) -> str | None:
        """Return why a set point is refused; None if it is in the range."""
        if self.minimum <= counts <= self.maximum:
            return None
        return f"t_set must be from {self.minimum} to {self.maximum} with {self.name}, not {counts}"


_KILOHMS: Final = {TecSensor.SENSOR_THERM20KOHM: 20.0, TecSensor.SENSOR_THERM200KOHM: 200.0}


def sensor_of(unit: Unit, number: int) -> Sensor:
    """Return a sensor by its number (page 359), with its range in the registry (page 356)."""
    one = TecSensor(number)
    case = unit.registry["quantities"]["tec_temperature"]["scale"]["cases"][one.name]
    return Sensor(one.name, case["minimum"], case["maximum"], _KILOHMS.get(one))

"""Laser sources: KLS101, KLS635, KLS1550 and TLS001, which hold the power of a built-in laser."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from stagewire_apt.enumerations import LaserDisplayUnits, LaserTriggerMode
from stagewire_virtual.thorlabs_apt.channel import Channel, live
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE, Laser

_LIMITS: Final[Mapping[int, float]] = {635: 2.5, 1550: 1.5}
"""The maximum power in mW by wavelength in nm; our choice, within the printed range of 6.5535 mW."""

_MAXIMUM_CURRENT: Final = 100.0
"""In mA, as in the example of page 298."""
_THRESHOLD: Final = 20.0
"""The current in mA above which light is emitted; our choice."""
_NEEDED: Final = 80.0
"""The current in mA of the maximum power of a new laser; our choice."""

_LARGEST: Final = 32760  # the largest reading in the status message (page 318)
_HOT: Final = 50.0  # the pigtail temperature in degrees Celsius that is an error (page 319)

_DISPLAYS: Final[Mapping[str, LaserDisplayUnits]] = {
    "display_current": LaserDisplayUnits.CURRENT,
    "display_power": LaserDisplayUnits.POWER,
    "display_power_dbm": LaserDisplayUnits.POWER_DBM,
}


class LaserSource(Laser):
    """The channel of a laser source.

    The unit tries to hold the power of the set point (page 296). If that requires more than the maximum
    current, because the laser has a low :attr:`efficiency`, the current stays at its maximum and the power
    stays lower.

    :param channel: its channel.
    """

    status_message = "LA_GET_STATUSUPDATE"

    pigtail_temperature = 25.0
    """The temperature of the pigtail in degrees Celsius; more than 50 set the error bit (page 319)."""

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self.maximum_power = _LIMITS[_wavelength(channel)]
        self._efficiency = 1.0
        if channel.answers("LA_SET_KCUBETRIGIOCONFIG"):
            self.digital_inputs = 3  # high if nothing is connected (page 324)

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new laser source."""
        wavelength = _wavelength(channel)
        return {
            "LA_MAXLIMITS": {
                "max_current": round(_MAXIMUM_CURRENT * 100),
                "max_power": round(_LIMITS[wavelength] * 10_000),
                "wave_length": wavelength,
            },
            "LA_DISPSETTINGS": {"disp_intensity": 255, "disp_units": LaserDisplayUnits.POWER},
            "LA_MMIPARAMS": {"disp_intensity": 100},
        }

    @property
    def efficiency(self) -> float:
        """The power at a current as a share of that of a new laser; 1 in a new unit."""
        return self._efficiency

    @efficiency.setter
    def efficiency(self, efficiency: float) -> None:
        self._efficiency = efficiency
        self.obey()

    @property
    def power(self) -> float:
        """The emitted power in mW."""
        return max(self.current - _THRESHOLD, 0.0) * self._slope

    def wanted_current(self) -> float:
        """Return the current that the power of the set point needs, or else the maximum, in mA."""
        power = self.demand * self.maximum_power
        needed = _THRESHOLD + power / self._slope if power else 0.0
        return min(needed, _MAXIMUM_CURRENT)

    @live("LA_CURRENTANDPOWER")
    def readings(self) -> dict[str, int]:
        """Return the current and the power as shares of their maximum."""
        return {
            "laser_current": round(self.current / _MAXIMUM_CURRENT * FULL_SCALE),
            "laser_power": min(round(self.power / self.maximum_power * FULL_SCALE), FULL_SCALE),
        }

    def status(self) -> Mapping[str, int]:
        """Return the readings, which end at 32760 here, and the status bits (pages 318 and 319)."""
        readings = {name: min(value, _LARGEST) for name, value in self.readings().items()}
        return {**readings, **self.status_bits()}

    def states(self) -> Mapping[str, bool]:
        """Return the status bits by name."""
        units = self.channel.parameter("LA_DISPSETTINGS", "disp_units")
        displays = {name: units == display for name, display in _DISPLAYS.items()}
        return {
            **super().states(),
            **displays,
            "closed_loop": True,
            "error": self.pigtail_temperature > _HOT,
        }

    def inputs(self) -> int:
        """Return the inputs; a port of a KLS635 or KLS1550 is one only in its mode (page 325)."""
        if not self.channel.answers("LA_SET_KCUBETRIGIOCONFIG"):
            return self.digital_inputs
        modes = (
            self.channel.parameter("LA_KCUBETRIGIOCONFIG", f"trig{port}_mode") for port in (1, 2)
        )
        enabled = sum(
            (mode == LaserTriggerMode.INPUT_LOGIC) << bit for bit, mode in enumerate(modes)
        )
        return self.digital_inputs & enabled

    @property
    def _slope(self) -> float:
        return self._efficiency * self.maximum_power / (_NEEDED - _THRESHOLD)


def _wavelength(channel: Channel) -> int:
    return 1550 if channel.unit.name.endswith("1550") else 635

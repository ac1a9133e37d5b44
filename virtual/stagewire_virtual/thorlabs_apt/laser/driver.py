"""Laser diode drivers, KLD101 and TLD001, with a simulated laser diode and its photodiode."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import (
    DiodeDisplayUnits,
    DiodeDuringAdjustment,
    LaserPolarity,
    LaserRampup,
    MaxCurrentAdjustment,
)
from stagewire_virtual.clock import SECOND
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.channel import Channel, handles, live, stored
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE, Laser

_KCUBE: Final = "LA_SET_KLDDIGOUTPUTS"  # a message of the KLD101 only
_FULL_CURRENT: Final = (220.0, 230.0)  # TLD001, KLD101: full scale in mA by the vendor's C headers
_LIMIT_STEP: Final = (200 / 255, 230 / 255)  # page 315
_LOWEST_LIMIT: Final = (17.0, 15.0)  # page 315
_RANGES: Final = ((0.01, 0.1, 1.0, 10.0), (0.009, 0.1, 0.9, 10.0))  # page 322, in mA

# The simulated diode; all of these are our choice.
_THRESHOLD: Final = 20.0  # mA
_SLOPE: Final = 0.8  # mW/mA above the threshold
_MONITOR: Final = 0.05  # mA of the photodiode for each mW
_OFFSET_VOLTS: Final = 1.8
_OHMS: Final = 3.0

RAMP_STEP: Final = SECOND // 10
"""The duration of each step of 10 % of the maximum current; the document has none."""

_UNDER: Final = 0.01  # share of its range below which a photocurrent is too low; our choice
_LIMIT_OF_NEW_UNIT: Final = 128  # about half of the range; our choice


class DiodeDriver(Laser):
    """The channel of a laser diode driver.

    With constant current, full scale of the set point is that of the current, 220 mA on a TLD001 and 230 mA
    on a KLD101. With constant power, it is the range of the photodiode. The current never exceeds the limit
    of ``LD_SET_MAXCURRENTDIGPOT``, which is refused unless ``LD_MAXCURRENTADJUST`` has enabled it. A unit
    powers on with constant current and without adjustment.

    :param channel: its channel.
    """

    status_message = "LD_GET_STATUSUPDATE"

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self._kind = int(channel.answers(_KCUBE))
        self._closed_loop = self._adjusting = False
        self._diode_connected = self._photodiode_connected = True
        self._photodiode_range = 4
        self._began = 0

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new driver."""
        return {
            "LD_MAXCURRENTDIGPOT": {"max_current": _LIMIT_OF_NEW_UNIT},
            "LD_MISCPARAMS": {"wa_calib_factor": _bits_of(1 / _MONITOR)},
            "LA_DISPSETTINGS": {"disp_intensity": 255, "disp_units": DiodeDisplayUnits.CURRENT},
            "LA_MMIPARAMS": {"disp_intensity": 100},
        }

    # For the user

    @property
    def photodiode_range(self) -> int:
        """The range of the photodiode, 1 to 4, which switches on the rear panel select; 4 in a new unit."""
        return self._photodiode_range

    @photodiode_range.setter
    def photodiode_range(self, number: int) -> None:
        if number not in (1, 2, 3, 4):
            raise BadOptionError(f"the range of the photodiode must be 1 to 4, not {number}")
        self._photodiode_range = number
        self.obey()

    @property
    def photodiode_connected(self) -> bool:
        """Whether the photodiode receives light; True in a new unit."""
        return self._photodiode_connected

    @photodiode_connected.setter
    def photodiode_connected(self, connected: bool) -> None:
        self._photodiode_connected = connected
        self.obey()

    @property
    def diode_connected(self) -> bool:
        """Whether a laser diode is connected; True in a new unit."""
        return self._diode_connected

    @diode_connected.setter
    def diode_connected(self, connected: bool) -> None:
        self._diode_connected = connected
        self.obey()

    @property
    def current(self) -> float:
        """The current of the laser diode in mA."""
        return min(super().current, self._ramp)

    @property
    def power(self) -> float:
        """The emitted power in mW."""
        return max(self.current - _THRESHOLD, 0.0) * _SLOPE

    @property
    def photo_current(self) -> float:
        """The current of the photodiode in mA."""
        return self.power * _MONITOR if self._photodiode_connected else 0.0

    @property
    def maximum_current(self) -> float:
        """The limit of the current in mA."""
        count = self.channel.parameter("LD_MAXCURRENTDIGPOT", "max_current")
        return max(count * _LIMIT_STEP[self._kind], _LOWEST_LIMIT[self._kind])

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state: output off, constant current, no adjustment."""
        super().power_on()
        self._closed_loop = self._adjusting = False

    @handles("LD_OPENLOOP")
    def open_loop(self, frame: Frame) -> None:
        """Select constant current."""
        self._closed_loop = False
        self.obey()

    @handles("LD_CLOSEDLOOP")
    def close_loop(self, frame: Frame) -> None:
        """Select constant power."""
        self._closed_loop = True
        self.obey()

    @handles("LD_MAXCURRENTADJUST")
    def adjust_maximum(self, frame: Frame) -> None:
        """Begin an adjustment, which sets the limit to its minimum, or end it (page 314)."""
        message = frame.message
        if not isinstance(message, m.LdMaxCurrentAdjust):
            return
        self._adjusting = message.adjust == MaxCurrentAdjustment.ENABLED
        if message.diode != DiodeDuringAdjustment.ON:
            self._switch_off()
        if self._adjusting:
            lowest = -(-_LOWEST_LIMIT[self._kind] // _LIMIT_STEP[self._kind])
            self.channel.parameters["LD_MAXCURRENTDIGPOT"]["max_current"] = int(lowest)
        self.obey()

    def refusal(self, frame: Frame) -> str | None:
        """Refuse a limit unless the adjustment is enabled (page 315)."""
        if isinstance(frame.message, m.LdSetMaxCurrentDigPot) and not self._adjusting:
            return "the adjustment of the maximum current is disabled (page 315)"
        return None

    @stored("LD_MAXCURRENTDIGPOT")
    def limit_was_set(self, frame: Frame) -> None:
        """Apply the new limit."""
        self.obey()

    @live("LD_MAXCURRENT")
    def maximum(self) -> dict[str, int]:
        """Return the limit of the current."""
        return {"max_current": self._counts(self.maximum_current)}

    @live("LD_CURRENTANDPOWER")
    def readings(self) -> dict[str, int]:
        """Return the current, the photocurrent and the voltage (page 299)."""
        return {
            "laser_current": self._counts(self.current),
            "laser_power": self._photo_counts,
            "laser_voltage": self._millivolts,
        }

    def status(self) -> Mapping[str, int]:
        """Return the readings and the status bits (pages 321 and 322)."""
        return {
            "laser_current": self._counts(self.current),
            "photo_current": self._photo_counts,
            "laser_voltage": self._millivolts,
            **self.status_bits(),
        }

    def states(self) -> Mapping[str, bool]:
        """Return the status bits by name."""
        polarity = self.channel.parameter("LD_MISCPARAMS", "laser_polarity")
        photo = self.photo_current / self._range
        target = self._follower.target
        ranges = {f"tia_range_{each}": each == self._photodiode_range for each in (1, 2, 3, 4)}
        return {
            **super().states(),
            **ranges,
            "closed_loop": self._closed_loop,
            "cathode_grounded": polarity == LaserPolarity.CATHODE_GROUNDED,
            "external_input_enabled": self.from_outside,
            "current_limit": self.on and self._unlimited() > self.maximum_current,
            "open_circuit": not self._diode_connected,
            "psu_ok": True,
            "tia_over_limit": photo > 1,
            "tia_under_limit": self.on and photo < _UNDER,
            "high_stability": self.on and self._counts(self.current) == self._counts(target),
        }

    # The current

    def wanted_current(self) -> float:
        """Return the current for the present demand, at most the limit, in mA."""
        return min(self._unlimited(), self.maximum_current) if self._diode_connected else 0.0

    def began(self) -> None:
        """Begin a ramp, if it is selected."""
        self._began = self.channel.clock.now

    def _unlimited(self) -> float:
        demand = self.demand
        if not self._closed_loop:
            return demand * _FULL_CURRENT[self._kind]
        if not demand:
            return 0.0
        if not self._photodiode_connected:
            return _FULL_CURRENT[self._kind]  # the loop sees no light and asks for more
        return _THRESHOLD + demand * self._range / _MONITOR / _SLOPE

    @property
    def _ramp(self) -> float:
        """The current that the ramp permits now in mA (page 306)."""
        if self.channel.parameter("LD_MISCPARAMS", "rampup") != LaserRampup.RAMPED:
            return self.maximum_current
        steps = 1 + (self.channel.clock.now - self._began) // RAMP_STEP
        return min(steps / 10, 1.0) * self.maximum_current

    @property
    def _range(self) -> float:
        return _RANGES[self._kind][self._photodiode_range - 1]

    @property
    def _photo_counts(self) -> int:
        return min(round(self.photo_current / self._range * FULL_SCALE), FULL_SCALE)

    @property
    def _millivolts(self) -> int:
        current = self.current
        return round((_OFFSET_VOLTS + _OHMS * current / 1000) * 1000) if current else 0

    def _counts(self, current: float) -> int:
        return min(round(current / _FULL_CURRENT[self._kind] * FULL_SCALE), FULL_SCALE)


def _bits_of(number: float) -> int:
    """Return the bits of a real number, which is how messages hold it."""
    return int.from_bytes(struct.pack("<f", number), "little")

"""The channel of a TTC001: its output, its loop, its readings and its status."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import TecDisplayMode, TecSensor
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel, LiveState, live, stored
from stagewire_virtual.thorlabs_apt.status_bits import StatusBits
from stagewire_virtual.thorlabs_apt.tec.load import CONDUCTANCE, PUMPED, Load, Loop
from stagewire_virtual.thorlabs_apt.tec.sensor import Sensor, sensor_of

GAIN: Final = 0.02
"""The change of the current in A/K for each step of the proportional gain; our choice."""

_ROOM: Final = 25.0  # degrees Celsius

_DISPLAYS: Final[Mapping[str, TecDisplayMode]] = {
    "display_actual": TecDisplayMode.DISPMODE_TACT,
    "display_set_point": TecDisplayMode.DISPMODE_TSET,
    "display_difference": TecDisplayMode.DISPMODE_DELTA,
    "display_current": TecDisplayMode.DISPMODE_ITEC,
}


class Cooler(Behaviour):
    """The channel of a temperature controller. Its output is off in a new unit and after each power-on.

    No message switches the output (the document has none): a test presses ENABLE with :meth:`press_enable`.
    While the output is on, a proportional loop drives the load within the limit of the current. An integral
    gain other than 0 adds the current that the set point needs at rest; the differential gain has no effect.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for settings, because nothing moves.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        if channel.settings != Settings():
            raise BadOptionError(
                f"{channel.unit.name} has a thermal load and accepts no stage, travel or position"
            )
        self._bits = StatusBits(channel.unit, "TEC_GET_STATUSUPDATE")
        self._load = Load(channel.clock, _ROOM)
        self._on = False
        self._sensor_connected = True

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new controller: an AD59x, 25 degrees and a limit of 1 A."""
        return {
            "TEC_TEMPSETPOINT": {"t_set": round(_ROOM * 100)},
            "TEC_IOSETTINGS": {"sensor": TecSensor.SENSOR_IC_AD59X, "i_lim": 1000},  # page 360
            "TEC_LOOPPARAMS": {"p_gain": 10, "i_gain": 10},
            "TEC_DISPSETTINGS": {"disp_intensity": 255},
        }

    # For the user

    @property
    def on(self) -> bool:
        """Whether the output is on."""
        return self._on

    def press_enable(self) -> None:
        """Press ENABLE on the front panel: switch the output on or off. It stays off without a sensor."""
        self._switch(not self._on)

    @property
    def sensor_connected(self) -> bool:
        """Whether the sensor is connected; without it, the output is off and the error bit is set."""
        return self._sensor_connected

    @sensor_connected.setter
    def sensor_connected(self, connected: bool) -> None:
        self._sensor_connected = connected
        self._switch(self._on)

    @property
    def surroundings(self) -> float:
        """The temperature of the surroundings in degrees Celsius; 25 in a new unit."""
        return self._load.surroundings

    @surroundings.setter
    def surroundings(self, temperature: float) -> None:
        self._load.surroundings = temperature
        self._switch(self._on)

    @property
    def temperature(self) -> float:
        """The temperature of the load in degrees Celsius."""
        return self._load.temperature

    @property
    def current(self) -> float:
        """The current of the element in amperes; positive heats, negative cools."""
        return self._load.current

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, with the output off."""
        self._switch(False)

    def refusal(self, frame: Frame) -> str | None:
        """Refuse a set point outside the range of the sensor (page 356)."""
        if isinstance(frame.message, m.TecSetTempSetPoint):
            return self._sensor.fault(frame.message.t_set)
        return None

    @stored("TEC_IOSETTINGS")
    def settings_were_set(self, frame: Frame) -> None:
        """Bring the set point into the range of the sensor, and apply the limit."""
        values = self.channel.parameters["TEC_TEMPSETPOINT"]
        values["t_set"] = self._sensor.nearest(values["t_set"])
        self._switch(self._on)

    @stored("TEC_TEMPSETPOINT", "TEC_LOOPPARAMS")
    def loop_was_set(self, frame: Frame) -> None:
        """Apply the set point or the gains."""
        self._switch(self._on)

    @live("TEC_READINGS")
    def readings(self) -> dict[str, int]:
        """Return the magnitude of the current in mA, the temperature and the set point (page 357)."""
        return {
            "i_tec": round(abs(self.current) * 1000),
            "t_act": self._sensor.counts(self.temperature),
            "t_set": self._set_point,
        }

    @live("TEC_STATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the status bits (page 361)."""
        shown = self.channel.parameter("TEC_DISPSETTINGS", "disp_mode")
        states = {name: shown == display for name, display in _DISPLAYS.items()}
        states["output_enabled"] = self._on
        states["error"] = not self._sensor_connected
        return {"status_bits": self._bits.value(states)}

    def status(self) -> Mapping[str, int]:
        """Return the readings and the status bits (pages 367 and 368)."""
        return {**self.readings(), **self.status_bits()}

    def row(self) -> LiveState:
        """Return the temperature and the state of the output."""
        state = f"on, {self.current:.2f} A" if self._on else "off"
        return LiveState(f"{self.temperature:.2f} degC", state)

    # The loop

    def _switch(self, on: bool) -> None:
        """Switch the output, with the present parameters."""
        self._on = on and self._sensor_connected
        self._load.drive(self._loop() if self._on else None)

    def _loop(self) -> Loop:
        target = self._sensor.temperature(self._set_point)
        limit = self.channel.parameter("TEC_IOSETTINGS", "i_lim") / 1000
        needed = (target - self.surroundings) * CONDUCTANCE / PUMPED
        hold = min(max(needed, -limit), limit)
        return Loop(
            target=target,
            hold=hold if self.channel.parameter("TEC_LOOPPARAMS", "i_gain") else 0.0,
            gain=self.channel.parameter("TEC_LOOPPARAMS", "p_gain") * GAIN,
            limit=limit,
        )

    @property
    def _set_point(self) -> int:
        return self.channel.parameter("TEC_TEMPSETPOINT", "t_set")

    @property
    def _sensor(self) -> Sensor:
        return sensor_of(self.channel.unit, self.channel.parameter("TEC_IOSETTINGS", "sensor"))

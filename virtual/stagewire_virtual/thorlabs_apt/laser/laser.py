"""The output of a laser, its key switch, its interlock and the source of its set point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from stagewire import Frame
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    handles,
    live,
    stored,
)
from stagewire_virtual.thorlabs_apt.facts import facts_of
from stagewire_virtual.thorlabs_apt.follower import Follower
from stagewire_virtual.thorlabs_apt.status_bits import StatusBits

FULL_SCALE: Final = 32767
"""Counts of a whole share: of the power (page 297), the current (page 298) or the photocurrent (page 299)."""

TIME_CONSTANT: Final = 0.01
"""The time constant of the laser current in seconds; the document has none."""


def share(value: float) -> float:
    """Return a share of full scale unchanged.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` if it is not a number from 0 to 1.
    """
    if not 0 <= value <= 1:
        raise BadOptionError(f"a signal must be a share of full scale from 0 to 1, not {value}")
    return value


class Laser(Behaviour):
    """The output of a laser. It is off in a new unit and after each power-on.

    Opening the key switch or the interlock switches the output off; closing it switches nothing on. A test
    sets :attr:`keyswitch_on`, :attr:`interlock_closed` and :attr:`external_signal`, turns the potentiometer
    or wheel with :meth:`turn`, and presses ENABLE with :meth:`press_enable`.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for settings, because a laser has no stage.
    """

    status_message: str
    """The status message of the unit; a subclass defines it."""

    digital_inputs = 0
    """The trigger ports as digital inputs: bit 0 is TRIG1, bit 1 is TRIG2."""

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        if channel.settings != Settings():
            raise BadOptionError(
                f"{channel.unit.name} is a laser and accepts no stage, travel or position"
            )
        self._bits = StatusBits(channel.unit, self.status_message)
        self._follower = Follower(channel.clock, TIME_CONSTANT)
        self._on = False
        self._keyswitch_on = self._interlock_closed = True
        self._external_signal = self._potentiometer = 0.0
        source = facts_of(channel.unit)["LA_SET_POWERCONTROLSOURCE"].values[0]
        self._sources = {number: name for name, number in (source.names or {}).items()}

    # For the user

    @property
    def on(self) -> bool:
        """Whether the output is on."""
        return self._on

    @property
    def keyswitch_on(self) -> bool:
        """Whether the key switch is on; True in a new unit."""
        return self._keyswitch_on

    @keyswitch_on.setter
    def keyswitch_on(self, on: bool) -> None:
        self._keyswitch_on = on
        if not on:
            self._switch_off()

    @property
    def interlock_closed(self) -> bool:
        """Whether the interlock is closed; True in a new unit."""
        return self._interlock_closed

    @interlock_closed.setter
    def interlock_closed(self, closed: bool) -> None:
        self._interlock_closed = closed
        if not closed:
            self._switch_off()

    @property
    def external_signal(self) -> float:
        """The signal at the SMA connector, as a share of full scale."""
        return self._external_signal

    @external_signal.setter
    def external_signal(self, signal: float) -> None:
        self._external_signal = share(signal)
        self.obey()

    def turn(self, by: float) -> None:
        """Turn the potentiometer or the wheel by a share of full scale; negative is down.

        The wheel of a K-Cube changes the set point, if it is selected as its source.
        """
        if self._source == "WHEEL_AND_SOFTWARE":
            values = self.channel.parameters["LA_POWERSETPOINT"]
            values["set_point"] = round(FULL_SCALE * _limited(self._set_point + by))
        else:
            self._potentiometer = _limited(self._potentiometer + by)
        self.obey()

    def press_enable(self) -> None:
        """Press ENABLE on the front panel: switch off if the output is on, else on."""
        if self._on:
            self._switch_off()
        elif self._fault is None:
            self._switch_on()

    @property
    def current(self) -> float:
        """The laser current in mA."""
        return self._follower.value

    @property
    def power(self) -> float:
        """The emitted power in mW."""
        raise NotImplementedError

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, with the output off."""
        self._switch_off()

    @handles("LA_ENABLEOUTPUT")
    def enable_output(self, frame: Frame) -> None:
        """Switch the output on, unless the key switch or the interlock is open."""
        fault = self._fault
        if fault is not None:
            self.channel.report_fault(frame, fault)
        elif not self._on:
            self._switch_on()

    @handles("LA_DISABLEOUTPUT")
    def disable_output(self, frame: Frame) -> None:
        """Switch the output off."""
        self._switch_off()

    @stored("LA_POWERSETPOINT", "LA_POWERCONTROLSOURCE")
    def demand_was_set(self, frame: Frame) -> None:
        """Follow another set point or source."""
        self.obey()

    @handles("MOT_SET_PZSTAGEPARAMDEFAULTS")
    def restore_defaults(self, frame: Frame) -> None:
        """Switch the output off, and restore all parameters from the EEPROM (page 125)."""
        self._switch_off()
        self.channel.restore()

    @live("LA_STATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the status bits."""
        return {"status_bits": self._bits.value(self.states())}

    def row(self) -> LiveState:
        """Return the power and the state of the output."""
        blocked = [text for text in (self._fault,) if text]
        return LiveState(f"{self.power:.3f} mW", ", ".join(["on" if self._on else "off", *blocked]))

    # For subclasses

    def states(self) -> Mapping[str, bool]:
        """Return the status bits by name."""
        return {
            "output_enabled": self._on,
            "keyswitch_enabled": self._keyswitch_on,
            "interlock_enabled": self._interlock_closed,
            "digital_input_1": bool(self.inputs() & 1),
            "digital_input_2": bool(self.inputs() & 2),
        }

    @property
    def demand(self) -> float:
        """The share of full scale that the selected source asks for."""
        match self._source:
            case "SOFTWARE" | "WHEEL_AND_SOFTWARE":
                return self._set_point
            case "EXTERNAL":
                return self._external_signal
            case "POTENTIOMETER":
                return self._potentiometer
            case _:
                return 0.0

    @property
    def from_outside(self) -> bool:
        """Whether the signal at the SMA connector is selected."""
        return self._source == "EXTERNAL"

    def wanted_current(self) -> float:
        """Return the current for the present demand in mA."""
        raise NotImplementedError

    def obey(self) -> None:
        """Let the current follow the present demand, if the output is on."""
        if self._on:
            self._follower.follow(self.wanted_current())

    def inputs(self) -> int:
        """Return the levels of the digital inputs in the status bits."""
        return self.digital_inputs

    def began(self) -> None:
        """React to an output that is being switched on."""

    def _switch_on(self) -> None:
        self._on = True
        self.began()
        self.obey()

    def _switch_off(self) -> None:
        self._on = False
        self._follower.jump(0.0)

    @property
    def _set_point(self) -> float:
        return self.channel.parameter("LA_POWERSETPOINT", "set_point") / FULL_SCALE

    @property
    def _source(self) -> str:
        number = self.channel.parameter("LA_POWERCONTROLSOURCE", "laser_source")
        return self._sources.get(number, "")

    @property
    def _fault(self) -> str | None:
        if not self._keyswitch_on:
            return "the key switch is off"
        return None if self._interlock_closed else "the interlock is open"


def _limited(value: float) -> float:
    return min(max(value, 0.0), 1.0)

"""A channel of a piezo controller: the effects of the messages of pages 94 to 126, and the status.

:func:`refusal` lists the SETs that are allowed in general but refused in some states.
"""

from __future__ import annotations

from collections.abc import Mapping

from stagewire import Frame, FramedMessage
from stagewire_apt import messages as m
from stagewire_apt.flags import LutOutputMode
from stagewire_apt.quantities import MAXIMUM_VOLTS, TRAVEL
from stagewire_virtual.errors import UnknownPartError
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    handles,
    live,
    stored,
)
from stagewire_virtual.thorlabs_apt.parameters import obey_enable_state
from stagewire_virtual.thorlabs_apt.piezo.actuator import (
    DEFAULTS,
    FULL_SCALE,
    LIMITS,
    finite,
    maximum_volts,
    travel_and_share,
)
from stagewire_virtual.thorlabs_apt.piezo.drive import CLOSED_LOOP_MODES, Drive
from stagewire_virtual.thorlabs_apt.piezo.panel import TriggerPorts, Wheel
from stagewire_virtual.thorlabs_apt.piezo.waveform import WaveformGenerator
from stagewire_virtual.thorlabs_apt.status_bits import StatusBits


def refusal(message: FramedMessage, drive: Drive) -> str | None:
    """Return why a message is refused now; None if it is accepted."""
    match message:
        case m.PzSetPosControlMode(mode=mode) if mode in CLOSED_LOOP_MODES:
            if not drive.has_strain_gauge:
                return "closed loop requires a strain gauge, and the actuator has none (page 94)"
        case m.PzSetOutputVolts() | m.PzSetOutputPos() if drive.zeroing:
            return "the channel is being zeroed"
        case m.PzSetOutputVolts() if drive.closed_loop:
            return "the output voltage cannot be set in closed loop (page 96)"
        case m.PzSetOutputPos() if not drive.closed_loop:
            return "the output position cannot be set in open loop (page 97)"
        case m.PzSetOutputLut(index=index) if index > drive.generator.last_index:
            return f"the table ends at index {drive.generator.last_index} (page 106)"
        case m.PzSetOutputLutParams():
            return _lut_refusal(message, drive.generator)
    return None


def _lut_refusal(message: m.PzSetOutputLutParams, generator: WaveformGenerator) -> str | None:
    most = generator.last_index
    if message.cycle_length > most or message.trig_repeat_cycle > most:
        return f"cycle_length and trig_repeat_cycle must be at most {most} (page 109)"
    triggers = generator.has_triggers and LutOutputMode(message.mode).outputlut_outputtrig
    if triggers and not 1 <= message.op_trig_start < message.cycle_length:
        return "op_trig_start must be at least 1 and below cycle_length (page 110)"
    return None


_HARDWARE_BITS = {750: "hardware_75v", 1000: "hardware_100v", 1500: "hardware_150v"}
_BPC30X = frozenset({"benchtop_piezo_2011", "card_slot_piezo_2011"})
"""The families with the status bits 13 to 15 (page 102)."""


class Piezo(Behaviour):
    """One channel of a piezo controller, with an actuator whose extension follows the voltage exactly.

    The document defines the settings, but hardly describes how the output follows them. Decisions:

    * The voltage changes at the slew rate of the present loop (page 123), and at most from zero to its
      maximum in 5 ms. In closed loop it also settles exponentially, with a time constant of 1 s /
      (proportional + integral constant): 8.7 ms with 100 and 15. If both are zero, it does not move.
    * The smooth modes take 1 s for the whole range when they open or close the loop (page 94).
    * A waveform is output unchanged, without slew limit and settling; then the set-point is output again.
    * The analogue inputs are added to the voltage in open loop and to the position in closed loop.
    * A disabled channel outputs zero volts. It stores settings, and outputs them when it is enabled.
    * A stuck actuator does not move; the voltage is not affected.

    ``settings.travel`` of 0 is an actuator without a strain gauge: it has no closed loop, no position and no
    zeroing. ``settings.position`` is the reading of the strain gauge at zero volts before zeroing, in steps
    of 100 nm.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an invalid travel or position.
    """

    can_stick = True

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self.travel, share = travel_and_share(channel.settings)
        # The controller reads it from the actuator when it is switched on.
        self._fitted_travel = self.travel
        """The travel of the actuator, in steps of 100 nm; 0 without a strain gauge."""
        self.digital_inputs = 0
        """Levels of the digital inputs, bit 0 for input 1; the status bits of BPC units report them."""
        self._drive = Drive(channel, share * FULL_SCALE if self.travel else None)
        self._bits = StatusBits(channel.unit, "PZ_GET_PZSTATUSUPDATE")
        self._wheel = Wheel(channel, lambda: self._drive.closed_loop)
        self.ports = TriggerPorts(channel, self._step, lambda: self._drive.position / FULL_SCALE)
        """The trigger ports of a K-Cube."""

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the parameters of a new controller."""
        return DEFAULTS

    # For tests

    @property
    def external_signal(self) -> float:
        """Signal at EXT IN as a fraction of the maximum, -1 to 1, if ``PZ_SET_INPUTVOLTSSRC`` adds it."""
        return self._drive.external_signal

    @external_signal.setter
    def external_signal(self, share: float) -> None:
        self._drive.external_signal = finite(share)
        self._drive.follow()

    @property
    def potentiometer(self) -> float:
        """Position of the potentiometer, 0 to 1, if ``PZ_SET_INPUTVOLTSSRC`` adds it."""
        return self._drive.potentiometer

    @potentiometer.setter
    def potentiometer(self, share: float) -> None:
        self._drive.potentiometer = finite(share)
        self._drive.follow()

    @property
    def trigger_input(self) -> bool:
        """Level of the trigger input, True for high; low in a new controller."""
        return self._drive.generator.trigger_input

    @trigger_input.setter
    def trigger_input(self, level: bool) -> None:
        self._drive.generator.trigger_input = level

    def trigger(self) -> None:
        """Apply one active edge to the trigger input, which starts an armed waveform."""
        self._drive.generator.pulse_input()

    @property
    def trigger_output(self) -> bool:
        """Present level of the trigger output, True for high."""
        return self._drive.generator.trigger_output

    @property
    def volts(self) -> float:
        """Present output voltage, in volts."""
        maximum = MAXIMUM_VOLTS.from_counts(maximum_volts(self.channel))
        return self._drive.output / FULL_SCALE * float(maximum)

    @property
    def position(self) -> float:
        """Present position, in µm from the zero of the strain gauge."""
        return self._drive.position / FULL_SCALE * float(TRAVEL.from_counts(self.travel))

    @property
    def sensor(self) -> int:
        """The position sensor of the actuator of a precision piezo controller, as in ``feedback_src``.

        1 is a strain gauge and 2 a capacitive sensor. If ``PZ_SET_PPC_IOSETTINGS`` selects the other one, the
        actuator has no position.
        """
        return self._drive.loop.sensor

    @sensor.setter
    def sensor(self, sensor: int) -> None:
        self._drive.loop.sensor = sensor
        self._drive.follow()

    @property
    def monitor(self) -> float:
        """Voltage of the monitor output of a precision piezo controller or a KPC101, in volts."""
        ask = self.channel.parameter
        signal = ask("PZ_PPC_IOSETTINGS", "monitor_op_sig")
        signal = signal or {1: 1, 2: 3}.get(ask("KPC_KCUBETRIGIOCONFIG", "monitor_signal"), 0)
        shares = {
            0: ask("KPC_KCUBETRIGIOCONFIG", "monitor_output") / FULL_SCALE,
            1: self.volts / 150,  # page 213: 150 V is 10 V
            2: self._drive.reading / FULL_SCALE,
            3: self._drive.position / FULL_SCALE,
        }
        return 10 * shares[signal]

    def turn(self, clicks: int) -> None:
        """Turn the wheel on the top panel, upwards for positive clicks, unless the panel is locked.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a unit without a wheel.
        """
        if not self._wheel.exists:
            raise UnknownPartError("wheel", [])
        if not self.channel.panel_is_locked():
            self._drive.asked = self._wheel.turned(clicks, self._drive.asked)

    def _step(self, way: int) -> None:
        """Change the set-point by the step of the wheel, as a trigger input does (page 237)."""
        self._drive.asked += way * self._wheel.step

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, not zeroed and without a waveform, and start towards the set-point."""
        self.travel = self._fitted_travel
        if self.channel.answers("PZ_SET_MAXTRAVEL"):
            self.travel = self.channel.parameter("PZ_MAXTRAVEL", "travel") or self.travel
        self._drive.reset()
        self._drive.follow()

    def enabled_changed(self) -> None:
        """Switch the output off, or start towards the set-point."""
        self._drive.enabled_changed()

    def stuck_changed(self) -> None:
        """Block the actuator, or release it."""
        self._drive.stuck_changed()

    def refusal(self, frame: Frame) -> str | None:
        """Return why a SET is refused now; None if it is accepted."""
        return refusal(frame.message, self._drive)

    def status(self) -> Mapping[str, int]:
        """Return the present output voltage, position and status bits (page 103)."""
        return {
            "op_voltage": round(self._drive.output),
            # the document has no negative positions, although the format is signed
            "position": min(max(round(self._drive.position), 0), FULL_SCALE),
            **self.status_bits(),
        }

    def row(self) -> LiveState:
        """Return the voltage, the position and the state."""
        measured = f"{self.volts:.2f} V"
        if self._drive.has_strain_gauge:
            measured += f", {self.position:.3f} µm"
        return LiveState(measured, self._doing())

    @live("PZ_PZSTATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the present status bits (pages 101 and 102)."""
        drive = self._drive
        names = {
            # an actuator is always connected; "active" concerns the unit, not the channel
            "actuator_connected": True,
            "zeroed": drive.zeroed,
            "zeroing": drive.zeroing,
            "strain_gauge_connected": drive.has_strain_gauge,
            "closed_loop": drive.closed_loop,
            "active": True,
            "channel_enabled": self.channel.enabled,
        }
        if self.channel.unit.facts.get("family") in _BPC30X:
            names[_HARDWARE_BITS[maximum_volts(self.channel)]] = True
        for number in range(8):
            names[f"digital_input_{number + 1}"] = bool(self.digital_inputs >> number & 1)
        for port in (1, 2):
            names[f"digital_input_{port}"] |= self.ports.is_high(port)
        names["position_below_range"] = drive.has_strain_gauge and round(drive.reading) < 0
        names["position_above_range"] = drive.has_strain_gauge and round(drive.reading) > FULL_SCALE
        return {"status_bits": self._bits.value(names)}

    @live("PZ_MAXTRAVEL")
    def max_travel(self) -> dict[str, int]:
        """Return the travel of the actuator, which does not depend on the maximum voltage (page 118)."""
        return {"travel": self.travel}

    @stored("PZ_MAXTRAVEL")
    def travel_was_set(self, frame: Frame) -> None:
        """Count positions in shares of the new travel; the actuator keeps its share."""
        assert isinstance(frame.message, m.PzSetMaxTravel)
        self.travel = frame.message.travel

    @live("PZ_OUTPUTMAXVOLTS")
    def output_max_volts(self) -> dict[str, int]:
        """Return the present maximum voltage and its flag (page 122)."""
        maximum = maximum_volts(self.channel)
        return {"voltage": maximum, "flags": LIMITS[maximum]}

    @stored(
        "PZ_OUTPUTVOLTS", "PZ_OUTPUTPOS", "PZ_INPUTVOLTSSRC", "PZ_PICONSTS", "PZ_TPZ_SLEWRATES",
        "PZ_PPC_IOSETTINGS", "KPC_IOSETTINGS",
    )  # fmt: skip
    def set_point_was_set(self, frame: Frame) -> None:
        """Start towards the new set-point."""
        self._drive.follow()

    @stored("PZ_PPC_PIDCONSTS")
    def constants_were_set(self, frame: Frame) -> None:
        """Use the new constants of the loop."""
        self._drive.loop.constants_were_set()
        self._drive.follow()

    @stored("PZ_PIDCRITERIA")
    def criteria_were_set(self, frame: Frame) -> None:
        """Select a group of constants, and use the new distance from the target (page 411)."""
        self._drive.loop.group_was_selected()
        self._drive.follow()

    @stored("PZ_PPC_NOTCHPARAMS")
    def notches_were_set(self, frame: Frame) -> None:
        """Change only the notch filters that the message addresses (page 210)."""
        self._drive.loop.notches_were_set()

    @stored("PZ_POSCONTROLMODE")
    def mode_was_set(self, frame: Frame) -> None:
        """Open or close the loop, and end a waveform, because its samples change their meaning (page 106)."""
        self._drive.stop_waveform()
        self._drive.follow(smooth=True)

    @stored("PZ_OUTPUTLUT")
    def sample_was_set(self, frame: Frame) -> None:
        """Load a sample of the waveform table."""
        assert isinstance(frame.message, m.PzSetOutputLut)
        self._drive.generator.table[frame.message.index] = frame.message.output

    @stored("PZ_LUTVALUETYPE")
    def lut_value_type_was_set(self, frame: Frame) -> None:
        """Clear the samples: the type must be set before they are loaded (page 126)."""
        self._drive.clear_waveform()

    @handles("PZ_START_LUTOUTPUT")
    def start_waveform(self, frame: Frame) -> None:
        """Start the waveform, or arm it (page 112)."""
        if not self.channel.enabled:
            fault: str | None = "the channel is disabled"
        elif self._drive.zeroing:
            fault = "the channel is being zeroed"
        else:
            fault = self._drive.start_waveform()
        if fault:
            self.channel.report_fault(frame, fault)

    @handles("PZ_STOP_LUTOUTPUT")
    def stop_waveform(self, frame: Frame) -> None:
        """End or disarm the waveform (page 112)."""
        self._drive.stop_waveform()

    @handles("PZ_SET_ZERO")
    def zero(self, frame: Frame) -> None:
        """Go to zero volts and use the reading of the strain gauge as zero (page 117)."""
        if not self.channel.enabled:
            self.channel.report_fault(frame, "the channel is disabled")
        elif not self._drive.has_strain_gauge:
            self.channel.report_fault(frame, "the actuator has no strain gauge")
        else:
            for name, field in (("PZ_OUTPUTVOLTS", "voltage"), ("PZ_OUTPUTPOS", "position_sw")):
                self.channel.parameters[name][field] = 0
            self._drive.zero()

    @handles("MOT_SET_PZSTAGEPARAMDEFAULTS")
    def restore_defaults(self, frame: Frame) -> None:
        """Restore all parameters from the EEPROM (page 125)."""
        self.channel.restore()
        obey_enable_state(self.channel)
        self._drive.loop.reset()
        self._drive.stop_waveform()

    def _doing(self) -> str:
        drive = self._drive
        states = {
            "disabled": not self.channel.enabled,
            "zeroing": drive.zeroing,
            "waveform": drive.generator.sample is not None,
            "waveform armed": drive.generator.armed,
            "closed loop": drive.closed_loop,
        }
        return next((state for state, holds in states.items() if holds), "open loop")

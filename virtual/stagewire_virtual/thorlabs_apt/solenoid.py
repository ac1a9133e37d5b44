"""The solenoid driver: an output that is switched manually, in cycles or by a trigger (pages 84 to 92)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import SolenoidInterlockMode, SolenoidOperatingMode, SolenoidState
from stagewire_apt.flags import LedMode, StepperStatusBits
from stagewire_virtual.clock import Timer
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.instrument import Unit
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    handles,
    live,
    stored,
)


@dataclass(frozen=True, slots=True)
class Cycles:
    """Cycles of an on time and an off time.

    :param began: the instant at which the output was first switched on, in nanoseconds.
    :param on: the on time of each cycle, in nanoseconds.
    :param off: the off time after it, in nanoseconds.
    :param number: the number of cycles; None for cycles without end.
    """

    began: int
    on: int
    off: int
    number: int | None

    @property
    def end(self) -> int | None:
        """The instant at which the off time of the last cycle ends; None for never."""
        return None if self.number is None else self.began + self.number * (self.on + self.off)

    def active(self, now: int) -> bool:
        """Return whether the output is on at an instant before the end."""
        return (now - self.began) % (self.on + self.off) < self.on


def _step(unit: Unit) -> int:
    """Return the step of the times in nanoseconds: 250 µs (page 87), or another that the registry has."""
    by_unit = unit.registry["quantities"]["solenoid_time"]["scale"]["units"]
    step = by_unit.get(unit.name, by_unit["TSC001"])["ms_per_count"]
    return round(Fraction(step["numerator"], step["denominator"]) * 1_000_000)


_OUTPUT_ON: Final = StepperStatusBits.forward_hardware_limit
# Page 77 assigns this bit to a limit switch, which a solenoid does not have. According to
# Thorlabs.MotionControl.TCube.Solenoid.h ("Solenoid output state"), units set it while the output is on.


class Solenoid(Behaviour):
    """The channel of a solenoid driver.

    ``SOLENOID_ON`` is the "Output ON" button of pages 85 and 91. :meth:`press_enable` is the ENABLE button of
    the front panel, which has the same effect (page 85). The effect depends on the operating mode. Manual:
    the output is switched on. Single: one cycle. Auto: cycles. Trigger: the unit is armed, and each
    :meth:`trigger` starts the cycles. ``SOLENOID_OFF`` ends everything. ``MOT_REQ_SOL_STATE`` returns the
    present output.

    Decisions where the document is silent or contradicts itself:

    * The number of cycles also applies in triggered mode (page 85; page 87 denies it).
    * A start during cycles restarts them ("overrides any existing settings", page 91). A trigger during
      cycles has no effect.
    * Cycle parameters take effect at the next start. Another operating mode switches off.
    * The output is switched off when a required interlock is opened and when the channel is disabled. It is
      not switched on again automatically.
    * ``MOT_MOVE_ABSOLUTE`` is in the list of page 138 without an explanation. The short form acts as
      ``SOLENOID_ON``. The long form does so for any position except 0, and acts as ``SOLENOID_OFF`` for 0.
      ``MOT_MOVE_COMPLETED`` is sent when the cycles are over, or immediately if no cycles are started.
      ``MOT_MOVE_STOP`` acts as ``SOLENOID_OFF``.
    * In the status, the position is 1 and bit 0 is set, as in real units, while the output is on;
      ``interlock_enabled`` is set while the interlock is fitted.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for settings, because nothing moves.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        if channel.settings != Settings():
            raise BadOptionError(
                f"{channel.unit.name} moves nothing and accepts no stage, travel or position"
            )
        self._interlock_closed = True
        self._held = False  # switched on in manual mode
        self._primed = False  # a trigger starts the cycles
        self._cycles: Cycles | None = None
        self._timer: Timer | None = None  # ends the cycles
        self._waiting: Frame | None = None  # the move that is completed at the end of the cycles
        self._mode_in_force = self._mode

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the parameters of a new driver.

        Times (1 s) and cycles are those of page 87; all modes of the LED are enabled (page 53).
        """
        second = 1_000_000_000 // _step(channel.unit)
        return {
            "MOT_AVMODES": {"mode_bits": sum(LedMode.bits.values())},
            "MOT_SOL_OPERATINGMODE": {"operating_mode": SolenoidOperatingMode.SOLENOID_MANUAL},
            "MOT_SOL_CYCLEPARAMS": {"on_time": second, "off_time": second, "num_cycles": 20},
            "MOT_SOL_INTERLOCKMODE": {"interlock_mode": SolenoidInterlockMode.SOLENOID_ENABLED},
            "MOT_SOL_STATE": {"state": SolenoidState.SOLENOID_OFF},
        }

    # For tests

    @property
    def on(self) -> bool:
        """Whether the output is on at this instant."""
        if self._cycles is not None:
            return self._cycles.active(self.channel.clock.now)
        return self._held

    @property
    def interlock_closed(self) -> bool:
        """Whether the interlock plug is fitted; True in a new driver."""
        return self._interlock_closed

    @interlock_closed.setter
    def interlock_closed(self, closed: bool) -> None:
        self._interlock_closed = closed
        self._obey_interlock()

    def trigger(self) -> None:
        """Apply a rising edge to TRIG IN, which starts the cycles of an armed unit."""
        if self._primed and self._cycles is None:
            self._begin(self._number_of_cycles)

    def press_enable(self) -> None:
        """Press ENABLE on the front panel: switch off if anything is active, else on like ``SOLENOID_ON``."""
        if self._busy:
            self._off()
        else:
            self._on()

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, with the output off."""
        self._off()

    def enabled_changed(self) -> None:
        """Switch the output off."""
        self._off()

    def status(self) -> Mapping[str, int]:
        """Return the present position, 1 for on, and the status bits (page 77)."""
        bits = _OUTPUT_ON if self.on else 0
        if self._interlock_closed:
            bits |= StepperStatusBits.interlock_enabled
        return {"position": int(self.on), "enc_count": 0, "status_bits": bits}

    def row(self) -> LiveState:
        """Return the output and the mode."""
        states = [SolenoidOperatingMode(self._mode).name.removeprefix("SOLENOID_").lower()]
        if self._cycles is not None:
            states.append("cycling")
        elif self._primed:
            states.append("primed")
        if not self._may_work:
            states.append("interlock open")
        return LiveState("on" if self.on else "off", ", ".join(states))

    @live("MOT_SOL_STATE")
    def state(self) -> dict[str, int]:
        """Return the present output."""
        return {"state": SolenoidState.SOLENOID_ON if self.on else SolenoidState.SOLENOID_OFF}

    @stored("MOT_SOL_STATE")
    def state_was_set(self, frame: Frame) -> None:
        """Switch on or off like the output buttons (page 91)."""
        if self.channel.parameter("MOT_SOL_STATE", "state") == SolenoidState.SOLENOID_ON:
            self._on(frame)
        else:
            self._off()

    @stored("MOT_SOL_OPERATINGMODE")
    def mode_was_set(self, frame: Frame) -> None:
        """Switch off if the mode has changed."""
        if self._mode != self._mode_in_force:
            self._off()

    @stored("MOT_SOL_INTERLOCKMODE")
    def interlock_mode_was_set(self, frame: Frame) -> None:
        """Switch off if the interlock is now required and not fitted (page 89)."""
        self._obey_interlock()

    @handles("MOT_MOVE_ABSOLUTE")
    def move_absolute(self, frame: Frame) -> None:
        """Switch on or off, and send a completion at the end."""
        if isinstance(frame.message, m.MotMoveAbsolute) and not frame.message.absolute_distance:
            self._off()
        elif not self._on(frame):
            return
        self._waiting = frame
        if self._cycles is None:
            self._send_completion()

    @handles("MOT_MOVE_STOP")
    def stop(self, frame: Frame) -> None:
        """Switch off, without an answer: the unit does not have MOT_MOVE_STOPPED."""
        self._off()

    # The output

    def _on(self, frame: Frame | None = None) -> bool:
        """Act like the button "Output ON" in the present mode; return False if that is refused."""
        fault = self._fault
        if fault is None:
            self._off()
            match self._mode:
                case SolenoidOperatingMode.SOLENOID_SINGLE:
                    self._begin(1)
                case SolenoidOperatingMode.SOLENOID_AUTO:
                    self._begin(self._number_of_cycles)
                case SolenoidOperatingMode.SOLENOID_TRIGGER:
                    self._primed = True
                case _:
                    self._held = True
        elif frame is not None:
            self.channel.report_fault(frame, fault)
        return fault is None

    def _off(self) -> None:
        """Switch off and end everything, without a completion."""
        if self._timer is not None:
            self._timer.cancel()
        self._held = self._primed = False
        self._cycles = self._timer = self._waiting = None
        self._mode_in_force = self._mode

    def _begin(self, number: int | None) -> None:
        ask, step = self.channel.parameter, _step(self.channel.unit)
        self._cycles = Cycles(
            self.channel.clock.now,
            ask("MOT_SOL_CYCLEPARAMS", "on_time") * step,
            ask("MOT_SOL_CYCLEPARAMS", "off_time") * step,
            number,
        )
        if self._cycles.end is not None:
            self._timer = self.channel.clock.call_at(self._cycles.end, self._end_cycles)

    def _end_cycles(self) -> None:
        self._cycles = self._timer = None
        self._send_completion()

    def _send_completion(self) -> None:
        if self._waiting is not None:
            done = m.MotMoveCompletedStepper(chan_ident=self.channel.ident, **self.status())
            self.channel.send(done, self._waiting)
            self._waiting = None

    def _obey_interlock(self) -> None:
        if not self._may_work:
            self._off()

    @property
    def _mode(self) -> int:
        return self.channel.parameter("MOT_SOL_OPERATINGMODE", "operating_mode")

    @property
    def _number_of_cycles(self) -> int | None:
        """The number of cycles; None for 0, which means without end (page 87)."""
        return self.channel.parameter("MOT_SOL_CYCLEPARAMS", "num_cycles") or None

    @property
    def _busy(self) -> bool:
        return self._held or self._primed or self._cycles is not None

    @property
    def _may_work(self) -> bool:
        """Whether the interlock is fitted or not required (page 89)."""
        mode = self.channel.parameter("MOT_SOL_INTERLOCKMODE", "interlock_mode")
        return self._interlock_closed or mode != SolenoidInterlockMode.SOLENOID_ENABLED

    @property
    def _fault(self) -> str | None:
        if not self.channel.enabled:
            return "the channel is disabled"
        if not self._may_work:
            return "the interlock is open (page 89)"
        return None

"""The solenoid driver: an output that is on or off, by hand, by time or by a trigger (pages 84 to 92)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import SolenoidInterlockMode, SolenoidOperatingMode, SolenoidState
from stagewire_apt.flags import LedMode, StepperStatusBits
from stagewire_apt.quantities import SOLENOID_TIME
from stagewire_virtual.clock import Timer
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


@dataclass(frozen=True, slots=True)
class Cycles:
    """On for a time, off for a time, over and over.

    :param began: the instant at which the output was switched on, in nanoseconds.
    :param on: how long it is on in each cycle, in nanoseconds.
    :param off: how long it is off after that.
    :param number: how many cycles there are; None for cycles without end.
    """

    began: int
    on: int
    off: int
    number: int | None

    @property
    def end(self) -> int | None:
        """The instant at which the off time of the last cycle is over; None for never."""
        return None if self.number is None else self.began + self.number * (self.on + self.off)

    def active(self, now: int) -> bool:
        """Say whether the output is on at an instant before the end."""
        return (now - self.began) % (self.on + self.off) < self.on


_STEP: Final = round(1_000_000 / SOLENOID_TIME.counts_per_unit)  # 250 µs in nanoseconds

_OUTPUT_ON: Final = StepperStatusBits.forward_hardware_limit
# Page 77 gives the bit to a limit switch, which a solenoid does not have. Units set it while the output is
# on, says Thorlabs.MotionControl.TCube.Solenoid.h ("Solenoid output state").


class Solenoid(Behaviour):
    """The channel of a solenoid driver.

    ``SOLENOID_ON`` is the "Output ON" button of pages 85 and 91, and :meth:`press_enable` the ENABLE button
    of the front panel, which page 85 makes the same: the output goes on (manual), on and off once (single),
    on and off over and over (auto), or the unit is primed, and each :meth:`trigger` starts the cycles
    (trigger). ``SOLENOID_OFF`` ends all of that. ``MOT_REQ_SOL_STATE`` is told whether the output is on at
    this instant.

    Where the document is silent or contradicts itself:

    * the number of cycles counts in triggered mode, too (page 85, against page 87);
    * a start while cycles run begins anew ("overrides any existing settings", page 91); a trigger while
      cycles run does nothing;
    * cycle parameters take effect with the next start; another operating mode ends what goes on;
    * with the interlock needed and not fitted the output goes off, and so it does with a channel that is
      disabled; it does not go on again by itself;
    * ``MOT_MOVE_ABSOLUTE`` stands in the list of page 138 without a word: its short form is
      ``SOLENOID_ON``, its long one is that for a position other than 0, and ``SOLENOID_OFF`` for 0.
      ``MOT_MOVE_COMPLETED`` follows when all cycles are over; at once, where no cycles are started.
      ``MOT_MOVE_STOP`` is ``SOLENOID_OFF``;
    * in the status, position is 1 while the output is on; bit 0 is set with it, as in real units, and
      ``interlock_enabled`` while the interlock is fitted.

    :param channel: its parameters, its clock, and the way to the host.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for settings: nothing is moved.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        if channel.settings != Settings():
            raise BadOptionError(
                f"{channel.unit.name} moves nothing: it has no stage, no travel and no position"
            )
        self._interlock_closed = True
        self._held = False  # switched on in manual mode
        self._primed = False  # a trigger begins the cycles
        self._cycles: Cycles | None = None
        self._timer: Timer | None = None  # at the end of the cycles
        self._waiting: Frame | None = None  # the move whose completion is to be told then
        self._mode_in_force = self._mode

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the values that parameter sets have in a new driver.

        Times and cycles are those of page 87; all modes of the LED are enabled (page 53).
        """
        return {
            "MOT_AVMODES": {"mode_bits": sum(LedMode.bits.values())},
            "MOT_SOL_OPERATINGMODE": {"operating_mode": SolenoidOperatingMode.SOLENOID_MANUAL},
            "MOT_SOL_CYCLEPARAMS": {"on_time": 4000, "off_time": 4000, "num_cycles": 20},
            "MOT_SOL_INTERLOCKMODE": {"interlock_mode": SolenoidInterlockMode.SOLENOID_ENABLED},
            "MOT_SOL_STATE": {"state": SolenoidState.SOLENOID_OFF},
        }

    # What the user of a virtual driver sets and sees

    @property
    def on(self) -> bool:
        """Whether the output is on at this instant."""
        if self._cycles is not None:
            return self._cycles.active(self.channel.clock.now)
        return self._held

    @property
    def interlock_closed(self) -> bool:
        """Whether the interlock plug is fitted; it is in a new driver."""
        return self._interlock_closed

    @interlock_closed.setter
    def interlock_closed(self, closed: bool) -> None:
        self._interlock_closed = closed
        self._obey_interlock()

    def trigger(self) -> None:
        """Give TRIG IN a rising edge: a unit that is primed begins its cycles."""
        if self._primed and self._cycles is None:
            self._begin(self._number_of_cycles)

    def press_enable(self) -> None:
        """Press ENABLE on the front panel: the same as the host's on, or off if there is something to end."""
        if self._busy:
            self._off()
        else:
            self._on()

    # What the controller asks

    def power_on(self) -> None:
        """Begin anew, with the output off."""
        self._off()

    def enabled_changed(self) -> None:
        """Switch the output off with the channel."""
        self._off()

    def status(self) -> Mapping[str, int]:
        """Return position 1 for on, and the status bits, of this instant (page 77)."""
        bits = _OUTPUT_ON if self.on else 0
        if self._interlock_closed:
            bits |= StepperStatusBits.interlock_enabled
        return {"position": int(self.on), "enc_count": 0, "status_bits": bits}

    def row(self) -> LiveState:
        """Return whether the output is on, and the mode."""
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
        """Return whether the output is on at this instant."""
        return {"state": SolenoidState.SOLENOID_ON if self.on else SolenoidState.SOLENOID_OFF}

    @stored("MOT_SOL_STATE")
    def state_was_set(self, frame: Frame) -> None:
        """Press the output buttons (page 91)."""
        if self.channel.parameter("MOT_SOL_STATE", "state") == SolenoidState.SOLENOID_ON:
            self._on(frame)
        else:
            self._off()

    @stored("MOT_SOL_OPERATINGMODE")
    def mode_was_set(self, frame: Frame) -> None:
        """End what goes on if this is another mode."""
        if self._mode != self._mode_in_force:
            self._off()

    @stored("MOT_SOL_INTERLOCKMODE")
    def interlock_mode_was_set(self, frame: Frame) -> None:
        """Switch the output off if the interlock is needed from now on and not fitted (page 89)."""
        self._obey_interlock()

    @handles("MOT_MOVE_ABSOLUTE")
    def move_absolute(self, frame: Frame) -> None:
        """Switch on or off, and tell when that is over."""
        if isinstance(frame.message, m.MotMoveAbsolute) and not frame.message.absolute_distance:
            self._off()
        elif not self._on(frame):
            return
        self._waiting = frame
        if self._cycles is None:
            self._send_completion()

    @handles("MOT_MOVE_STOP")
    def stop(self, frame: Frame) -> None:
        """Switch off; the list of the unit has no message that would tell it."""
        self._off()

    # What it does

    def _on(self, frame: Frame | None = None) -> bool:
        """Do what the button "Output ON" does in the mode that is set; False if it is refused."""
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
        """End what goes on, with the output off; whoever waits for its end is not told."""
        if self._timer is not None:
            self._timer.cancel()
        self._held = self._primed = False
        self._cycles = self._timer = self._waiting = None
        self._mode_in_force = self._mode

    def _begin(self, number: int | None) -> None:
        ask = self.channel.parameter
        self._cycles = Cycles(
            self.channel.clock.now,
            ask("MOT_SOL_CYCLEPARAMS", "on_time") * _STEP,
            ask("MOT_SOL_CYCLEPARAMS", "off_time") * _STEP,
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
        """How many cycles are set; None for 0, which has no end (page 87)."""
        return self.channel.parameter("MOT_SOL_CYCLEPARAMS", "num_cycles") or None

    @property
    def _busy(self) -> bool:
        return self._held or self._primed or self._cycles is not None

    @property
    def _may_work(self) -> bool:
        """Whether the interlock is fitted, or not needed (page 89)."""
        mode = self.channel.parameter("MOT_SOL_INTERLOCKMODE", "interlock_mode")
        return self._interlock_closed or mode != SolenoidInterlockMode.SOLENOID_ENABLED

    @property
    def _fault(self) -> str | None:
        if not self.channel.enabled:
            return "the channel is disabled"
        if not self._may_work:
            return "the interlock is open (page 89)"
        return None

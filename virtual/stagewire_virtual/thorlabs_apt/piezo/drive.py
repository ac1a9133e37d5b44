"""What a piezo channel puts out, and what the strain gauge of its actuator reads.

An output goes to its target at most so fast, and gently at the end if a loop is closed (:class:`Approach`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stagewire_apt.enumerations import PositionControlMode
from stagewire_apt.flags import InputVoltsSource
from stagewire_virtual.clock import SECOND, Timer
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.piezo.actuator import FULL_SCALE, READING_TIME
from stagewire_virtual.thorlabs_apt.piezo.waveform import MILLISECOND, WaveformGenerator


@dataclass(frozen=True, slots=True)
class Approach:
    """The way of a value to its target, known at every instant from a formula.

    Two things hold it back. A slew limit lets it change by one count in ``crossing`` nanoseconds at most. A
    loop makes its speed what is left of the way, divided by ``settling``. It keeps to the slower of the
    two: a straight ramp, and an exponential from where that is the slower one. With neither it is at its
    target at once.

    :param start: the value at the beginning, in counts.
    :param target: where it goes, in counts.
    :param began: the instant at which it sets out, in nanoseconds.
    :param crossing: nanoseconds for a count; 0 for no slew limit.
    :param settling: time constant in nanoseconds; 0 for no loop, infinite for a loop that does nothing.
    """

    start: float
    target: float
    began: int = 0
    crossing: float = 0.0
    settling: float = 0.0

    @property
    def ramp(self) -> int:
        """How long the straight part lasts, in nanoseconds; without a loop it ends at the target."""
        return math.ceil(max(0.0, abs(self.target - self.start) - self._knee) * self.crossing)

    def at(self, now: int) -> float:
        """Return the value at the instant ``now``."""
        elapsed = now - self.began
        way = self.target - self.start
        straight = max(0.0, abs(way) - self._knee)
        if elapsed < straight * self.crossing:
            return self.start + math.copysign(elapsed / self.crossing, way)
        if not self.settling:
            return self.target
        left = math.exp(-(elapsed - straight * self.crossing) / self.settling)
        return self.target - math.copysign(abs(way) - straight, way) * left

    @property
    def _knee(self) -> float:
        """The distance to the target, in counts, at which the loop becomes slower than the slew limit."""
        return self.settling / self.crossing if self.crossing else math.inf


CLOSED_LOOP_MODES = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)
"""The modes that employ the feedback (page 94)."""

_AMPLIFIER_TIME = SECOND // 200
# From zero to the maximum voltage where no slew rate is set: 5 ms. The document has no figure.

_SMOOTH_TIME = SECOND
# From zero to full scale when a smooth mode opens or closes the loop; "over a longer period" (page 94).

_SMOOTH_MODES = (PositionControlMode.OPEN_LOOP_SMOOTH, PositionControlMode.CLOSED_LOOP_SMOOTH)
_LOWEST = -FULL_SCALE - 1


class Drive:
    """An amplifier, and an actuator that extends by the share of travel that the voltage is of its maximum.

    All values are counts, 32767 for the maximum voltage or the whole travel. What is asked of it stands in
    the parameters of the channel; who changes them calls :meth:`follow`.

    :param channel: parameters, clock and whether it is enabled.
    :param offset: what the strain gauge reads at zero volts before zeroing; None without a strain gauge.
    """

    def __init__(self, channel: Channel, offset: float | None) -> None:
        self._channel = channel
        self._offset = offset
        self._stuck_at: float | None = None
        self.zeroing = False
        """Whether the channel is being zeroed."""
        self._timer: Timer | None = None
        self.external_signal = 0.0
        self.potentiometer = 0.0
        slew_rate = channel.unit.registry["quantities"]["slew_rate"]["scale"]
        self._slew_counts: int = slew_rate["counts_at_setting"]
        # By as much a slew rate is divided, in shares of the maximum voltage for each ms (page 123).
        self.generator = WaveformGenerator(channel.unit, channel.clock, self._waveform_over)
        self.reset()

    def reset(self) -> None:
        """Be as after a power cycle: zero volts, not zeroed, no waveform loaded or put out."""
        self._end_zeroing()
        self.generator.clear()
        self.zeroed = False
        self._zero = 0.0  # the reading that counts as position 0
        self._approach = Approach(0.0, 0.0)

    @property
    def has_strain_gauge(self) -> bool:
        """Whether the position is known, and a loop can be closed."""
        return self._offset is not None

    @property
    def closed_loop(self) -> bool:
        """Whether the mode that is set employs the feedback."""
        return self._channel.parameter("PZ_POSCONTROLMODE", "mode") in CLOSED_LOOP_MODES

    @property
    def output(self) -> float:
        """The output voltage at this instant."""
        sample = self.generator.sample
        if sample is not None:
            return self._output_for(sample)
        return self._approach.at(self._channel.clock.now)

    @property
    def position(self) -> float:
        """What the strain gauge reads at this instant, from its zero; 0 without one."""
        return 0.0 if self._offset is None else self._reading - self._zero

    def follow(self, *, smooth: bool = False) -> None:
        """Set out from where the output is to what is asked of it now.

        :param smooth: the loop was opened or closed, which the smooth modes do slowly.
        """
        self._set_out(self.output, smooth)

    def start_waveform(self) -> str | None:
        """Put the waveform out or arm it, and return None; or why it cannot be."""
        start = self.output
        fault = self.generator.start(self._channel.parameters["PZ_OUTPUTLUTPARAMS"])
        if fault is None:
            self._set_out(start)
        return fault

    def stop_waveform(self) -> None:
        """End or disarm the waveform, and go back to what was set."""
        start = self.output
        self.generator.stop()
        self._set_out(start)

    def clear_waveform(self) -> None:
        """End or disarm the waveform, and forget its samples."""
        self.stop_waveform()
        self.generator.clear()

    def enabled_changed(self) -> None:
        """Go to zero volts because the channel was disabled, or to what is set because it was enabled."""
        self._end_zeroing()
        self.stop_waveform()

    def stuck_changed(self) -> None:
        """Hold the actuator where it is, or let it go; the voltage goes on in any case."""
        self._stuck_at = self.output if self._channel.stuck else None

    def zero(self) -> None:
        """Put zero volts out, read the position, and take it as zero from then on (page 117).

        Until then nothing else has an effect on the output. Zeroing again begins anew.
        """
        self._end_zeroing()
        start = self.output
        self.generator.stop()
        self._go_to_zero_volts(start)
        self.zeroed = False
        self.zeroing = True
        self._timer = self._channel.clock.call_later(
            self._approach.ramp + READING_TIME, self._take_zero
        )

    def _take_zero(self) -> None:
        self._end_zeroing()
        self.zeroed = True
        self._zero = self._reading
        self.follow()

    def _end_zeroing(self) -> None:
        self.zeroing = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _waveform_over(self, last_sample: int) -> None:
        self._set_out(self._output_for(last_sample))

    def _set_out(self, start: float, smooth: bool = False) -> None:
        """Go from ``start`` to what is asked, at the slew rate and with the loop that are in force."""
        if self.zeroing:
            return
        if not self._channel.enabled:
            self._go_to_zero_volts(start)
            return
        closed = self.closed_loop
        gently = smooth and self._channel.parameter("PZ_POSCONTROLMODE", "mode") in _SMOOTH_MODES
        self._approach = Approach(
            start,
            self._output_for(self._asked),
            self._channel.clock.now,
            self._crossing(closed, _SMOOTH_TIME if gently else _AMPLIFIER_TIME),
            self._settling if closed else 0.0,
        )

    def _go_to_zero_volts(self, start: float) -> None:
        crossing = self._crossing(closed=False, least=_AMPLIFIER_TIME)
        self._approach = Approach(start, 0.0, self._channel.clock.now, crossing)

    def _crossing(self, closed: bool, least: int) -> float:
        """Return nanoseconds for a count at the slew rate of a loop; the whole range takes ``least``."""
        slew = self._channel.parameter("PZ_TPZ_SLEWRATES", "slew_closed" if closed else "slew_open")
        return max(least, MILLISECOND * self._slew_counts / slew if slew else 0) / FULL_SCALE

    @property
    def _asked(self) -> int:
        """The voltage or the position that was set, by the loop in force."""
        if self.closed_loop:
            return self._channel.parameter("PZ_OUTPUTPOS", "position_sw")
        return self._channel.parameter("PZ_OUTPUTVOLTS", "voltage")

    @property
    def _settling(self) -> float:
        """The time constant of the loop in nanoseconds; for ever if both constants are 0 (page 100)."""
        ask = self._channel.parameter
        gain = ask("PZ_PICONSTS", "prop_const") + ask("PZ_PICONSTS", "int_const")
        return SECOND / gain if gain else math.inf

    @property
    def _reading(self) -> float:
        extension = self.output if self._stuck_at is None else self._stuck_at
        return extension + (self._offset or 0.0)

    def _output_for(self, asked: int) -> float:
        """Return the voltage for what was set, a position in closed loop, with what the inputs add to it."""
        source = InputVoltsSource(self._channel.parameter("PZ_INPUTVOLTSSRC", "volt_src"))
        output = float(asked)
        if source.external_signal:
            output += self.external_signal * FULL_SCALE
        if source.potentiometer:
            output += self.potentiometer * FULL_SCALE
        if self.closed_loop:
            output += self._zero - (self._offset or 0.0)
        return min(max(output, _LOWEST), FULL_SCALE)

"""The output of a piezo channel, and the reading of the strain gauge of its actuator.

An output approaches its target with a limited slew rate and, in closed loop, exponentially
(:class:`Approach`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stagewire_apt.enumerations import PositionControlMode
from stagewire_apt.flags import InputVoltsSource
from stagewire_virtual.clock import SECOND, Timer
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.piezo.actuator import FULL_SCALE, READING_TIME, output_range
from stagewire_virtual.thorlabs_apt.piezo.loop import Loop
from stagewire_virtual.thorlabs_apt.piezo.waveform import MILLISECOND, WaveformGenerator


@dataclass(frozen=True, slots=True)
class Approach:
    """The approach of a value to its target, as a formula of time.

    Two things limit its speed. The slew limit allows one count in ``crossing`` nanoseconds. The loop allows
    the remaining distance divided by ``settling``. The lower limit applies: first a straight ramp, then an
    exponential. Without limits the value reaches its target immediately.

    :param start: the first value, in counts.
    :param target: the target, in counts.
    :param began: the instant at which it starts, in nanoseconds.
    :param crossing: nanoseconds per count; 0 for no slew limit.
    :param settling: the time constant in nanoseconds; 0 for no loop, infinite for a loop that does nothing.
    :param window: the distance from the target, in counts, within which ``near`` is the time constant.
    :param near: the time constant within the window.
    """

    start: float
    target: float
    began: int = 0
    crossing: float = 0.0
    settling: float = 0.0
    window: float = 0.0
    near: float = 0.0

    @property
    def ramp(self) -> int:
        """The duration of the ramp in nanoseconds; without a loop the ramp ends at the target."""
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
        left = self._left(abs(way) - straight, elapsed - straight * self.crossing)
        return self.target - math.copysign(left, way)

    def _left(self, distance: float, elapsed: float) -> float:
        """Return what remains of a distance some time after the loop became slower than the slew limit."""
        if self.window and distance > self.window and not math.isinf(self.settling):
            until = self.settling * math.log(distance / self.window)
            if elapsed < until:
                return distance * math.exp(-elapsed / self.settling)
            distance, elapsed = self.window, elapsed - until
        constant = self.near if self.window and distance <= self.window else self.settling
        return distance * math.exp(-elapsed / constant)

    @property
    def _knee(self) -> float:
        """The distance to the target, in counts, at which the loop becomes slower than the slew limit."""
        return self.settling / self.crossing if self.crossing else math.inf


CLOSED_LOOP_MODES = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)
"""The modes that use the feedback (page 94)."""

_AMPLIFIER_TIME = SECOND // 200
# From zero to the maximum voltage without a slew rate: 5 ms. The document has no value.

_SMOOTH_TIME = SECOND
# From zero to full scale when a smooth mode opens or closes the loop; "over a longer period" (page 94).

_SMOOTH_MODES = (PositionControlMode.OPEN_LOOP_SMOOTH, PositionControlMode.CLOSED_LOOP_SMOOTH)


class Drive:
    """An amplifier, and an actuator whose extension is proportional to the voltage.

    All values are counts; 32767 is the maximum voltage or the whole travel. The set-points are in the
    parameters of the channel; call :meth:`follow` after changing them.

    :param channel: its channel.
    :param offset: the reading of the strain gauge at zero volts before zeroing; None without a strain gauge.
    """

    def __init__(self, channel: Channel, offset: float | None) -> None:
        self._channel = channel
        self._offset = offset
        self._stuck_at: float | None = None
        self.loop = Loop(channel)
        """The constants of the loop, and its sensor."""
        self.zeroing = False
        """Whether the channel is being zeroed."""
        self._timer: Timer | None = None
        self.external_signal = 0.0
        self.potentiometer = 0.0
        slew_rate = channel.unit.registry["quantities"]["slew_rate"]["scale"]
        self._slew_counts: int = slew_rate["counts_at_setting"]
        # Divisor of a slew rate, which gives fractions of the maximum voltage per ms (page 123).
        self.generator = WaveformGenerator(channel.unit, channel.clock, self._waveform_over)
        self.reset()

    def reset(self) -> None:
        """Reset to the power-on state: zero volts, not zeroed, no waveform."""
        self._end_zeroing()
        self.generator.clear()
        self.loop.reset()
        self.zeroed = False
        self._zero = 0.0  # the reading that counts as position 0
        self._approach = Approach(0.0, 0.0)

    @property
    def has_strain_gauge(self) -> bool:
        """Whether the actuator has the sensor of the loop, which position and closed loop require."""
        return self._offset is not None and self.loop.sensor_is_selected

    @property
    def closed_loop(self) -> bool:
        """Whether the present mode uses the feedback."""
        return self._channel.parameter("PZ_POSCONTROLMODE", "mode") in CLOSED_LOOP_MODES

    @property
    def output(self) -> float:
        """The present output voltage."""
        sample = self.generator.sample
        if sample is not None:
            return self._output_for(sample)
        return self._approach.at(self._channel.clock.now)

    @property
    def position(self) -> float:
        """The present reading of the strain gauge, relative to its zero; 0 without one."""
        return self.reading - self._zero if self.has_strain_gauge else 0.0

    @property
    def reading(self) -> float:
        """The present reading of the sensor before zeroing."""
        extension = self.output if self._stuck_at is None else self._stuck_at
        return extension + (self._offset or 0.0)

    def follow(self, *, smooth: bool = False) -> None:
        """Start from the present output towards the set-point.

        :param smooth: whether the loop was opened or closed, which takes longer in the smooth modes.
        """
        self._set_out(self.output, smooth)

    def start_waveform(self) -> str | None:
        """Start or arm the waveform and return None, or return why that is refused."""
        start = self.output
        fault = self.generator.start(self._channel.parameters["PZ_OUTPUTLUTPARAMS"])
        if fault is None:
            self._set_out(start)
        return fault

    def stop_waveform(self) -> None:
        """End or disarm the waveform, and return to the set-point."""
        start = self.output
        self.generator.stop()
        self._set_out(start)

    def clear_waveform(self) -> None:
        """End or disarm the waveform, and clear its samples."""
        self.stop_waveform()
        self.generator.clear()

    def enabled_changed(self) -> None:
        """Go to zero volts if the channel was disabled, or to the set-point if it was enabled."""
        self._end_zeroing()
        self.stop_waveform()

    def stuck_changed(self) -> None:
        """Block the actuator, or release it; the voltage is not affected."""
        self._stuck_at = self.output if self._channel.stuck else None

    def zero(self) -> None:
        """Go to zero volts, then read the position and use it as zero (page 117).

        Nothing else affects the output until then. Calling it again restarts the zeroing.
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
        self._zero = self.reading
        self.follow()

    def _end_zeroing(self) -> None:
        self.zeroing = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _waveform_over(self, last_sample: int) -> None:
        self._set_out(self._output_for(last_sample))

    def _set_out(self, start: float, smooth: bool = False) -> None:
        """Start from ``start`` towards the set-point, with the present slew rate and loop."""
        if self.zeroing:
            return
        if not self._channel.enabled:
            self._go_to_zero_volts(start)
            return
        closed = self.closed_loop
        gently = smooth and self._channel.parameter("PZ_POSCONTROLMODE", "mode") in _SMOOTH_MODES
        self._approach = Approach(
            start,
            self._output_for(self.asked),
            self._channel.clock.now,
            self._crossing(closed, _SMOOTH_TIME if gently else _AMPLIFIER_TIME),
            self.loop.settling if closed else 0.0,
            self.loop.window if closed else 0.0,
            self.loop.near_settling if closed else 0.0,
        )

    def _go_to_zero_volts(self, start: float) -> None:
        crossing = self._crossing(closed=False, least=_AMPLIFIER_TIME)
        self._approach = Approach(start, 0.0, self._channel.clock.now, crossing)

    def _crossing(self, closed: bool, least: int) -> float:
        """Return nanoseconds per count at the slew rate of a loop, at least ``least`` for the whole range."""
        slew = self._channel.parameter("PZ_TPZ_SLEWRATES", "slew_closed" if closed else "slew_open")
        return max(least, MILLISECOND * self._slew_counts / slew if slew else 0) / FULL_SCALE

    @property
    def asked(self) -> int:
        """The set-point of the present loop, a voltage or a position."""
        return self._channel.parameter(*self._set_point)

    @asked.setter
    def asked(self, counts: int) -> None:
        name, field = self._set_point
        self._channel.parameters[name][field] = min(max(counts, 0), FULL_SCALE)
        self.follow()

    @property
    def _set_point(self) -> tuple[str, str]:
        """The set of the set-point of the present loop, and its field."""
        if self.closed_loop:
            return "PZ_OUTPUTPOS", "position_sw"
        return "PZ_OUTPUTVOLTS", "voltage"

    def _output_for(self, asked: int) -> float:
        """Return the voltage for a set-point, which is a position in closed loop, including the inputs."""
        ask = self._channel.parameter
        source = InputVoltsSource(
            ask("PZ_INPUTVOLTSSRC", "volt_src", ask("PZ_PPC_IOSETTINGS", "control_src"))
        )
        output = float(asked)
        if source.external_signal and ask("KPC_IOSETTINGS", "analog_input", 1):
            output += self.external_signal * FULL_SCALE
        if source.potentiometer:
            output += self.potentiometer * FULL_SCALE
        low, high = output_range(self._channel)
        if self.closed_loop:
            # A loop whose sensor reads nothing drives the actuator to the end of its range.
            output = output + self._zero - (self._offset or 0.0) if self.has_strain_gauge else high
        return min(max(output, low), high)

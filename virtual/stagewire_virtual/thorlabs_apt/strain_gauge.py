"""The strain gauge reader: a signal as a position, a voltage or a force (pages 117 and 127 to 129)."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

from stagewire import Frame
from stagewire_apt.enumerations import DisplayMode, HubAnalogueOutput
from stagewire_apt.quantities import FORCE_CALIBRATION, TRAVEL
from stagewire_virtual.clock import SECOND, Timer
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel, LiveState, handles, live
from stagewire_virtual.thorlabs_apt.piezo.actuator import (
    FULL_SCALE,
    READING_TIME,
    finite,
    travel_and_share,
)
from stagewire_virtual.thorlabs_apt.piezo.panel import TriggerPorts
from stagewire_virtual.thorlabs_apt.status_bits import StatusBits

SAMPLE_TIME: Final = SECOND // 500
"""Readings are sampled at 500 Hz (page 129)."""

SMOOTHED_SAMPLES: Final = 16
"""The number of samples in a smoothed reading, 32 ms; the document does not define it.

A KSG101 has a setting for it, ``smoothing_samples`` (Issue 37, page 246).
"""

_MOST_SAMPLES: Final = 1000

_FULL_SCALE_VOLTS: Final = (
    10  # full scale of the displayed voltage; the document has no value (page 129)
)

_PORTS: Final = "KSG_KCUBETRIGIOCONFIG"

Signal = float | Callable[[float], float]
"""A fraction of full scale, or a function that returns one for a time in seconds."""


class StrainGauge(Behaviour):
    """The channel of a strain gauge reader, whose signal the user sets.

    The reading is the signal as a fraction of full scale, which is 32767 (page 129). Full scale is the travel
    for a position, the force calibration for a force, and the analogue output for a voltage. Position and
    force are relative to the zero that ``PZ_SET_ZERO`` reads after 1 s; the voltage is not.

    Decisions where the document is silent: ``smoothed`` is the mean of the last 16 samples, in two's
    complement, because it is printed as a word. A disabled channel continues to read, because it drives
    nothing. The status message has the voltage as ``op_voltage``, and the position, not below 0, as
    ``position``.

    ``settings.travel`` is the answer to ``PZ_REQ_MAXTRAVEL``, and ``settings.position`` is the first signal,
    both in steps of 100 nm.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an invalid travel or position.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self.travel, share = travel_and_share(channel.settings)
        """The travel of the measured actuator, in steps of 100 nm."""
        self._noise = 0.0
        self._noise_seed = channel.random.getrandbits(64)
        self._bits = StatusBits(channel.unit, "PZ_GET_PZSTATUSUPDATE")
        # Each signal with its first sample, at most one per sample; the readings only need the last ones.
        self._signals: deque[tuple[int, Signal]] = deque([(0, share)], _MOST_SAMPLES)
        self._zero = 0
        self._zeroed = False
        self._zeroing: Timer | None = None
        self.ports = TriggerPorts(channel, lambda way: None, self._share)
        """The trigger ports of a K-Cube; its limits apply to the reading."""

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the parameters of a new reader; missing values are those of the registry."""
        return {
            "PZ_TPZ_DISPSETTINGS": {"disp_intensity": 255},
            "PZ_TSG_IOSETTINGS": {
                "hub_analogue_output": HubAnalogueOutput.HUB_ANALOGUEOUT_1,
                "display_mode": DisplayMode.DISPUNITS_POSITION,
            },
            "KSG_KCUBEMMIPARAMS": {"disp_intensity": 100},
            "KSG_KCUBETRIGIOCONFIG": {"upper_lim": 100, "smoothing_samples": SMOOTHED_SAMPLES},
        }

    @property
    def signal(self) -> Signal:
        """The measured signal: a fraction of full scale, -1 to 1, or a function of the time in seconds.

        The function is called with the instants of samples.
        """
        return self._signals[-1][1]

    @signal.setter
    def signal(self, signal: Signal) -> None:
        if not callable(signal):
            finite(signal)
        if self._signals[-1][0] == self._sample:
            self._signals.pop()
        self._signals.append((self._sample, signal))

    @property
    def noise(self) -> float:
        """Standard deviation of the noise on each sample, as a fraction of full scale.

        The noise is derived from the seed.
        """
        return self._noise

    @noise.setter
    def noise(self, share: float) -> None:
        self._noise = finite(share)

    def power_on(self) -> None:
        """Reset to the power-on state, not zeroed; the signal stays."""
        self._forget_zero()

    def status(self) -> Mapping[str, int]:
        """Return the present voltage, position and status bits (page 103)."""
        voltage = self._at(self._sample)
        names = {
            "strain_gauge_connected": True,
            "zeroed": self._zeroed,
            "zeroing": self._zeroing is not None,
            "active": True,
            "channel_enabled": self.channel.enabled,
            "digital_input_1": self.ports.is_high(1),
            "digital_input_2": self.ports.is_high(2),
        }
        return {
            "op_voltage": voltage,
            "position": min(max(voltage - self._zero, 0), FULL_SCALE),
            "status_bits": self._bits.value(names),
        }

    def row(self) -> LiveState:
        """Return the reading in the displayed unit."""
        share = self.reading()["reading"] / FULL_SCALE
        match self._mode:
            case DisplayMode.DISPUNITS_VOLTAGE:
                shown = f"{share * _FULL_SCALE_VOLTS:.3f} V"
            case DisplayMode.DISPUNITS_FORCE:
                shown = f"{share * self._newtons:.3f} N"
            case _:
                shown = f"{share * float(TRAVEL.from_counts(self.travel)):.3f} µm"
        return LiveState(shown, "zeroing" if self._zeroing else "reading")

    @live("PZ_TSG_READING")
    def reading(self) -> dict[str, int]:
        """Return the reading and the smoothed reading of the last sample (page 129)."""
        last = self._sample
        count = self.channel.parameter(_PORTS, "smoothing_samples", SMOOTHED_SAMPLES) or 1
        samples = range(max(0, last - count + 1), last + 1)
        smoothed = round(sum(self._shown(sample) for sample in samples) / len(samples))
        return {"reading": self._shown(last), "smoothed": smoothed & 0xFFFF}

    @live("PZ_MAXTRAVEL")
    def max_travel(self) -> dict[str, int]:
        """Return the travel of the actuator (page 118)."""
        return {"travel": self.travel}

    @handles("PZ_SET_ZERO")
    def zero(self, frame: Frame) -> None:
        """Use the reading after 1 s as zero (page 117); the reader has no output to set to zero volts."""
        self._forget_zero()
        self._zeroing = self.channel.clock.call_later(READING_TIME, self._take_zero)

    def _forget_zero(self) -> None:
        if self._zeroing is not None:
            self._zeroing.cancel()
            self._zeroing = None
        self._zero = 0
        self._zeroed = False

    def _take_zero(self) -> None:
        self._zeroing = None
        self._zeroed = True
        self._zero = self._at(self._sample)

    @property
    def _mode(self) -> int:
        return self.channel.parameter("PZ_TSG_IOSETTINGS", "display_mode")

    @property
    def _newtons(self) -> float:
        calibration = self.channel.parameter("PZ_TSG_IOSETTINGS", "force_calib")
        return float(FORCE_CALIBRATION.from_counts(calibration))

    @property
    def _sample(self) -> int:
        """The number of the last sample since the clock was created."""
        return self.channel.clock.now // SAMPLE_TIME

    def _share(self) -> float:
        """Return the present reading as a fraction of full scale."""
        return self._shown(self._sample) / FULL_SCALE

    def _shown(self, sample: int) -> int:
        """Return the reading of a sample in the display mode."""
        zero = 0 if self._mode == DisplayMode.DISPUNITS_VOLTAGE else self._zero
        return min(max(self._at(sample) - zero, -FULL_SCALE), FULL_SCALE)

    def _at(self, sample: int) -> int:
        """Return the signal at a sample in counts."""
        signal = next(
            (signal for since, signal in reversed(self._signals) if since <= sample),
            self._signals[0][1],
        )
        share = finite(signal(sample * SAMPLE_TIME / SECOND)) if callable(signal) else signal
        if self._noise:
            share += random.Random(self._noise_seed + sample).gauss(0.0, self._noise)
        return round(min(max(share, -1.0), 1.0) * FULL_SCALE)

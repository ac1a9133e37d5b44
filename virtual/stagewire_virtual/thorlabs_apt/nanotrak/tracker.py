"""The circle of a NanoTrak: its diameter, its way to the highest signal, and the scan of the whole range.

The circle takes one step in each revolution. The steps are computed when somebody looks, always at the same
instants, so a reading does not change what the circle does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND, Clock, Timer
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.nanotrak.signal import (
    COUNTS,
    FULL_RANGE,
    NOISE,
    OVER_READ,
    TIA,
    VOLTS,
    Amplifier,
    Reading,
    Spot,
    reading,
)

SAMPLES: Final = 7000
"""Samples per second (page 256)."""

STEP: Final = 0.2
"""The share of the distance to the maximum in a revolution, with a diameter of 1 and a gain of 600."""

NORMAL_GAIN: Final = 600
"""The default gain (page 267)."""

HOMING: Final = SECOND // 10
"""How long the circle moves to its home position; the document has no value."""

POINTS: Final = 96
"""Lines of a scan, and points of a line (page 288)."""

LINE_TIME: Final = SECOND // 20
"""How long a line takes; the document has no value."""

_SOFTWARE, _BY_SIGNAL, _BY_RANGE = 1, 2, 3  # circle diameter modes (page 256)

_ADJUSTMENTS: Final[Mapping[int, Callable[[float], float]]] = {  # page 257
    1: lambda share: share,
    2: lambda share: math.log10(1 + 9 * share),
    3: lambda share: share**2,
    4: lambda share: share**3,
}


class Tracker:
    """The position of the circle, and the signal there.

    :param clock: the clock.
    :param amplifier: the amplifier of the signal.
    :param spot: the signal.
    :param parameter: returns a value of a parameter set: ``parameter(set, field)``.
    """

    def __init__(
        self, clock: Clock, amplifier: Amplifier, spot: Spot, parameter: Callable[[str, str], int]
    ) -> None:
        self._clock = clock
        self._amplifier = amplifier
        self._spot = spot
        self._parameter = parameter
        self.reset()

    def reset(self) -> None:
        """Reset to the power-on state: the middle of the range, latched."""
        self._axes: tuple[bool, bool] = (False, False)
        self._centre = (FULL_RANGE / 2, FULL_RANGE / 2)
        self._since = self._clock.now  # the beginning of the present revolution
        self._way: tuple[tuple[float, float], tuple[float, float]] | None = (
            None  # to the home position
        )
        self._follow_range()

    @property
    def axes(self) -> tuple[bool, bool]:
        """Whether the circle follows the signal on the horizontal and on the vertical axis."""
        return self._axes

    def track(self, horizontal: bool, vertical: bool) -> None:
        """Follow the signal on some axes; on none, hold the position."""
        self.catch_up()
        if self._way is not None and not (horizontal or vertical):
            self._centre, self._way = self._present(), None
        if self._way is None and (horizontal, vertical) != self._axes:
            self._since = self._clock.now
        self._axes = (horizontal, vertical)

    def go(self, a: float, b: float) -> None:
        """Move the centre to a position, in NanoTrak units; then continue to track or to hold."""
        self.catch_up()
        self._way = self._present(), (a, b)
        self._since = self._clock.now

    @property
    def moves(self) -> bool:
        """Whether the circle is on its way to its home position."""
        self.catch_up()
        return self._way is not None

    @property
    def spot(self) -> Spot:
        """The signal."""
        return self._spot

    @spot.setter
    def spot(self, spot: Spot) -> None:
        self.catch_up()
        self._spot = spot
        self._follow_range()

    def changed(self) -> None:
        """React to changed parameters, before which :meth:`catch_up` was called."""
        self._follow_range()

    @property
    def position(self) -> tuple[float, float]:
        """The centre of the circle in NanoTrak units."""
        self.catch_up()
        return self._present()

    def read(self) -> Reading:
        """Return the present reading, which is that of the centre of the circle."""
        self.catch_up()
        self._follow_range()
        return self._read()

    @property
    def has_signal(self) -> bool:
        """Whether there is enough light to track."""
        return self._spot.current(*self.position) >= NOISE

    @property
    def diameter(self) -> float:
        """The present diameter of the circle in NanoTrak units."""
        mode = self._parameter("PZ_NTCIRCPARAMS", "circ_dia_mode")
        if mode == _BY_RANGE:
            return self._parameter("PZ_NTCIRCDIALUT", f"lut_val_{self._amplifier.range}") / COUNTS
        if mode == _BY_SIGNAL:
            low = self._parameter("PZ_NTCIRCPARAMS", "abs_pwr_min_circ_dia")
            high = self._parameter("PZ_NTCIRCPARAMS", "abs_pwr_max_circ_dia")
            adjust = self._parameter("PZ_NTCIRCPARAMS", "abs_pwr_adjust_type")
            return (high - (high - low) * _ADJUSTMENTS[adjust](self._read().share)) / COUNTS
        return self._parameter("PZ_NTCIRCPARAMS", "circ_dia_sw") / COUNTS

    def catch_up(self) -> None:
        """Take all steps until now."""
        now = self._clock.now
        if self._way is not None:
            if now < self._since + HOMING:
                return
            self._centre, self._way = self._way[1], None
            self._since += HOMING
            self._follow_range()
        if not any(self._axes):
            return
        samples = self._parameter("PZ_NTCIRCPARAMS", "circ_osc_freq")
        revolution = samples * SECOND // SAMPLES
        steps = (now - self._since) // revolution
        self._since += steps * revolution
        for _ in range(steps):
            before = self._centre, self._amplifier.range
            self._step()
            if (self._centre, self._amplifier.range) == before:
                return  # so nothing will change until somebody changes something

    def _step(self) -> None:
        """Go through one revolution."""
        signal = self._spot.current(*self._centre)
        if signal >= NOISE and self._read().check != OVER_READ:
            gain = self._parameter("PZ_NTGAINPARAMS", "nt_gain_sw") / NORMAL_GAIN
            share = STEP * gain * self.diameter
            ways = zip(self._axes, self._centre, (self._spot.a, self._spot.b), strict=True)
            a, b = (
                min(max(at + share * (to - at), 0.0), FULL_RANGE) if follows else at
                for follows, at, to in ways
            )
            self._centre = a, b
        self._follow_range()

    def _present(self) -> tuple[float, float]:
        if self._way is None:
            return self._centre
        done = (self._clock.now - self._since) / HOMING
        (from_a, from_b), (to_a, to_b) = self._way
        return from_a + (to_a - from_a) * done, from_b + (to_b - from_b) * done

    def _read(self) -> Reading:
        source = self._parameter("PZ_NTFEEDBACKSRC", "feedback_src")
        if source == TIA:
            return self._amplifier.read(self._spot.current(*self._present()))
        return reading(self._spot.volts(*self._present()), VOLTS[source])

    def _follow_range(self) -> None:
        if self._parameter("PZ_NTFEEDBACKSRC", "feedback_src") == TIA:
            self._amplifier.follow(self._spot.current(*self._present()))


class Scan:
    """The scan of a KNA101 (page 288). It sends line by line; the circle is afterwards where it was.

    :param channel: the channel that sends the lines.
    :param amplifier: the amplifier, whose range stays fixed.
    :param tracker: has the signal.
    """

    def __init__(self, channel: Channel, amplifier: Amplifier, tracker: Tracker) -> None:
        self._channel = channel
        self._amplifier = amplifier
        self._tracker = tracker
        self._timer: Timer | None = None
        self._line = 0

    @property
    def runs(self) -> bool:
        """Whether a scan runs."""
        return self._timer is not None

    def start(self, cause: Frame) -> None:
        """Start a scan, or start again with the first line."""
        self.stop()
        self._line = 0
        self._cause = cause
        self._timer = self._channel.clock.call_later(LINE_TIME, self._say_line)

    def stop(self) -> None:
        """Stop the scan, if one runs."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _say_line(self) -> None:
        line, self._line = self._line, self._line + 1
        more = self._line < POINTS
        clock = self._channel.clock
        self._timer = clock.call_later(LINE_TIME, self._say_line) if more else None
        at = [FULL_RANGE * number / (POINTS - 1) for number in range(POINTS)]
        spot = self._tracker.spot
        shares = [self._amplifier.read(spot.current(a, at[line])).share for a in at]
        message = m.KnaGetXyScan(
            line_number=line,
            range=self._amplifier.range,
            intensity_map=bytes(round(255 * share) for share in shares),
        )
        self._channel.send(message, self._cause)

"""Firmware of a TDC001 whose velocities and accelerations are those of its servo cycle.

Page 14 states the units of a servo controller: counts per cycle and counts per cycle squared, each with 16
fractional bits. The cycle of 2048 periods of 6 MHz is from page 39 of Issue 37.
"""

from __future__ import annotations

from typing import ClassVar

from corpus_tdc001 import Tdc001

CYCLE = 2048 / 6e6
PER_SPEED = 65536 * CYCLE
PER_ACCELERATION = 65536 * CYCLE**2


class Z8Tdc001(Tdc001):
    """The controller and its actuator.

    :param clock: returns the time in seconds.
    """

    SETTINGS: ClassVar = {
        **Tdc001.SETTINGS,
        "velocity": Tdc001.SETTINGS["velocity"].with_values(0, 1048, 1534736),
        "jog": Tdc001.SETTINGS["jog"].with_values(2, 3430, 0, 524, 767368, 2),
        "home": Tdc001.SETTINGS["home"].with_values(2, 1, 1151052, 10291),
    }

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration / PER_ACCELERATION, speed / PER_SPEED

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration / PER_ACCELERATION, speed / PER_SPEED

    def home_parameters(self) -> tuple[float, float]:
        speed, offset = super().home_parameters()
        return speed / PER_SPEED, offset

    def stop_deceleration(self) -> float:
        """Return the deceleration of a profiled stop."""
        return super().stop_deceleration() / PER_ACCELERATION

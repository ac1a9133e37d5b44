"""Faults of motion in the TDC001 of the corpus whose velocities have the scale of its servo cycle."""

from __future__ import annotations

from corpus_faults import Faults
from corpus_z8 import Z8Tdc001

FAULTS = Faults()


@FAULTS.moves("dc-status-velocity")
class Z8VelocityAlwaysZero(Z8Tdc001):
    """The reported velocity is always 0."""

    def reported_velocity(self) -> int:
        return 0


@FAULTS.moves("velocity-parameters")
class Z8FifthTooFast(Z8Tdc001):
    """Moves run 20 % above the maximum velocity."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration, 1.2 * speed


@FAULTS.moves("velocity-parameters")
class Z8AllFifthTooFast(Z8Tdc001):
    """Moves and jogs run 20 % above their maximum velocities."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration, 1.2 * speed

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration, 1.2 * speed


@FAULTS.moves("velocity-parameters")
class Z8AccelerationTwiceAsHigh(Z8Tdc001):
    """Moves and jogs use twice their accelerations."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return 2 * acceleration, speed

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, 2 * acceleration, speed


@FAULTS.moves("velocity-parameters")
class Z8AccelerationHalved(Z8Tdc001):
    """Moves use half their acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration / 2, speed


@FAULTS.moves("jog-parameters")
class Z8JogAccelerationTwiceAsHigh(Z8Tdc001):
    """Jogs use twice their acceleration."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, 2 * acceleration, speed

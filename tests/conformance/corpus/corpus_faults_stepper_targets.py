"""Faults of targets, of a disabled channel and of scales in the stepper controller of the corpus."""

from __future__ import annotations

import math

from corpus_faults import Faults
from corpus_motion import Path
from corpus_stepper import Stepper

FAULTS = Faults()


@FAULTS.moves("relative-move-long", "relative-move")
class StepsClipped(Stepper):
    """A relative move covers at most 8000 counts."""

    def move_relative(self, distance: int) -> None:
        super().move_relative(max(-8000, min(8000, distance)))


@FAULTS.moves("absolute-move-long", "absolute-move")
class StepsOfSixteenBits(Stepper):
    """An absolute move uses the lower 16 bits of its position, as a signed number."""

    def move_absolute(self, position: int) -> None:
        super().move_absolute((position + 0x8000) % 0x10000 - 0x8000)


@FAULTS.moves("absolute-move-long", "absolute-move")
class StepsMissing(Stepper):
    """A move over more than 1000 counts ends 40 counts before its target."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        side = math.copysign(40, target - self.place())
        short = side if abs(target - self.place()) > 1000 else 0
        super().move_to(target - short, motion, acceleration, speed)


@FAULTS.moves("channel-enable")
class StepsWhileDisabled(Stepper):
    """A disabled channel stops, but carries out the next move."""

    def go(self, motion: str, path: Path) -> None:
        enabled, self.axis.enabled = self.axis.enabled, True
        super().go(motion, path)
        self.axis.enabled = enabled


@FAULTS.moves("position-counter-set")
class CounterStartsSteps(Stepper):
    """SET_POSCOUNTER sets the counter, and then moves back to the position before."""

    def set_position(self, frame: bytes) -> None:
        before = self.position()
        super().set_position(frame)
        self.move_absolute(before)


@FAULTS.moves("velocity-parameters")
class StepsFifthTooFast(Stepper):
    """Moves run 20 % above the maximum velocity."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration, 1.2 * speed


@FAULTS.moves("velocity-parameters")
class StepsAccelerationTwiceAsHigh(Stepper):
    """Moves use twice their acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return 2 * acceleration, speed


@FAULTS.moves("velocity-parameters")
class StepsAccelerationHalved(Stepper):
    """Moves use half their acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration / 2, speed

"""Faults of targets, of disabled channels and of the counter in the TDC001 of the corpus."""

from __future__ import annotations

import math
from typing import ClassVar

from corpus_faults import Faults
from corpus_motion import to_target
from corpus_motor import MOVE
from corpus_tdc001 import Tdc001

FAULTS = Faults()
CLIPPED = 8000


@FAULTS.moves("relative-move-long", "relative-move")
class RelativeMovesClipped(Tdc001):
    """A relative move covers at most 8000 counts."""

    def move_relative(self, distance: int) -> None:
        super().move_relative(max(-CLIPPED, min(CLIPPED, distance)))


@FAULTS.moves("absolute-move-long", "absolute-move")
class TargetsOfSixteenBits(Tdc001):
    """An absolute move uses the lower 16 bits of its position, as a signed number."""

    def move_absolute(self, position: int) -> None:
        super().move_absolute((position + 0x8000) % 0x10000 - 0x8000)


@FAULTS.moves("absolute-move-long", "absolute-move")
class TargetsOfSixteenBitsNearZero(TargetsOfSixteenBits):
    """An absolute move uses the lower 16 bits of its position. The stage is near its zero."""

    START = 12000.0


@FAULTS.moves("absolute-move-long", "absolute-move")
class TargetsOfSixteenUnsignedBits(Tdc001):
    """An absolute move uses the lower 16 bits of a positive position, without a sign."""

    def move_absolute(self, position: int) -> None:
        super().move_absolute(position & 0xFFFF if position > 0 else position)


@FAULTS.moves("absolute-move-long", "absolute-move", "relative-move", "move-completed")
class EndsFortyShort(Tdc001):
    """Every move ends 40 counts before its target."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        side = math.copysign(40, target - self.place())
        super().move_to(target - side, motion, acceleration, speed)


@FAULTS.moves("absolute-move-long", "absolute-move", "move-completed")
class LongMovesEndFortyShort(Tdc001):
    """A move over more than 1000 counts ends 40 counts before its target."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        side = math.copysign(40, target - self.place())
        short = side if abs(target - self.place()) > 1000 else 0
        super().move_to(target - short, motion, acceleration, speed)


@FAULTS.moves("absolute-move-completed", "relative-move-completed", "move-completed")
class CompletedFortyShort(Tdc001):
    """MOVE_COMPLETED is sent 40 counts before the target, with the status bits of a motor at rest."""

    told = True

    def due(self) -> float:
        return min(super().due(), self.near())

    def near(self) -> float:
        """Return when the motor is 40 counts from its target; infinite after the message."""
        if self.told or not self.axis.motion or not self.axis.path.pieces:
            return math.inf
        last = self.axis.path.pieces[-1]
        return last.end - math.sqrt(2 * 40 / abs(last.a)) if last.a else math.inf

    def catch_up(self) -> None:
        if self.clock() >= self.near():
            self.now = max(self.now, self.near())
            self.told = True
            motion, self.axis.motion = self.axis.motion, ""
            super().report_completed()
            self.axis.motion = motion
        super().catch_up()

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        self.told = False
        super().move_to(target, motion, acceleration, speed)

    def report_completed(self) -> None:
        if not self.told:
            super().report_completed()
        self.told = True


@FAULTS.moves("at-rest-unchanged")
class StoredPositionMovesAtOnce(Tdc001):
    """SET_MOVEABSPARAMS starts the move for which it stores the position."""

    def set(self, name: str, frame: bytes) -> None:
        super().set(name, frame)
        if name == "absolute":
            self.move_absolute(self.stored_position())


@FAULTS.moves("channel-enable")
class MovesOfADisabledChannel(Tdc001):
    """A disabled channel stops, but carries out the next move."""

    def go(self, motion: str, path: object) -> None:
        enabled, self.axis.enabled = self.axis.enabled, True
        super().go(motion, path)  # type: ignore[arg-type]
        self.axis.enabled = enabled


@FAULTS.moves("position-counter-set")
class CounterStartsAMotion(Tdc001):
    """SET_POSCOUNTER sets the counter, and then moves back to the position before."""

    def set_position(self, frame: bytes) -> None:
        before = self.position()
        super().set_position(frame)
        self.move_absolute(before)


@FAULTS.moves("position-counter-set")
class CounterStartsAStep(Tdc001):
    """SET_POSCOUNTER sets the counter, and then moves by 2000 counts."""

    def set_position(self, frame: bytes) -> None:
        super().set_position(frame)
        path = to_target(
            self.now, self.place(), 0, self.place() + 2000, *reversed(self.velocity_parameters())
        )
        self.go(MOVE, path)


@FAULTS.moves("velocity-parameters")
class FifthTooFast(Tdc001):
    """All moves run 20 % above the maximum velocity."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration, 1.2 * speed


@FAULTS.moves("velocity-parameters")
class AccelerationTwiceAsHigh(Tdc001):
    """Moves use twice their acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return 2 * acceleration, speed


@FAULTS.moves("velocity-parameters")
class AccelerationHalved(Tdc001):
    """Moves use half their acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration / 2, speed


@FAULTS.moves("jog-parameters")
class JogAccelerationHalved(Tdc001):
    """Jogs use half their acceleration."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration / 2, speed


@FAULTS.moves("jog-parameters")
class JogsFifthTooFast(Tdc001):
    """Jogs run 20 % above their maximum velocity."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration, 1.2 * speed


@FAULTS.breaks("dc-status-velocity")
class VelocityZeroUntilTheEnd(Tdc001):
    """The reported velocity is 0 in motion, also of a motor that is slow."""

    SETTINGS: ClassVar = {
        **Tdc001.SETTINGS,
        "velocity": Tdc001.SETTINGS["velocity"].with_values(0, 137216, 27000),
    }

    def reported_velocity(self) -> int:
        return 0

"""Faults of motion in the MS-2000 of the corpus."""

from __future__ import annotations

import math
from dataclasses import replace

from corpus_faults import Faults
from corpus_motion import Path, resting, to_rest, to_target
from corpus_ms2000 import Axis, Ms2000

FAULTS = Faults()
BUSY = ("status-busy", "status-not-busy")


@FAULTS.moves("increment-up", "increment-down", "increment-used")
class IncrementFromTheTarget(Ms2000):
    """An increment is added to the target, not to the position."""

    def increment_move(self, axis: Axis, side: int) -> None:
        self.set_target(axis, axis.target + side * axis.increment)


@FAULTS.moves("increment-down")
class IncrementDownGoesUp(Ms2000):
    """INCREMENT_MOVE_DOWN moves up."""

    def increment_move(self, axis: Axis, side: int) -> None:
        super().increment_move(axis, 1)


@FAULTS.moves("increment-used", "increment-up", "increment-down")
class IncrementNeverNegative(Ms2000):
    """A negative increment moves like a positive one."""

    def increment_move(self, axis: Axis, side: int) -> None:
        self.set_target(axis, self.position(axis) + side * abs(axis.increment))


@FAULTS.moves("top-speed-limits-travel", "maximum-speed-reply")
class TopSpeedOfTheFactory(Ms2000):
    """Moves always use the default top speed."""

    def top_speed(self, axis: Axis) -> float:
        return 60_000


@FAULTS.moves("top-speed-limits-travel", "maximum-speed-reply")
class TopSpeedPassed(Ms2000):
    """Moves to a target run at one and a half times the top speed."""

    def path_to(self, axis: Axis, place: float) -> Path:
        x, v = self.place(axis), axis.path.speed(self.now)
        top, acceleration = 1.5 * self.top_speed(axis), self.acceleration(axis)
        return to_target(self.now, x, v, place, top, acceleration)


@FAULTS.moves("ramp-time-meaning", "ramp-time-acceleration")
class RampIgnored(Ms2000):
    """Axes ramp in one millisecond, whatever the ramp time."""

    def acceleration(self, axis: Axis) -> float:
        return self.top_speed(axis) / 0.001


@FAULTS.moves("ramp-time-meaning", "ramp-time-acceleration")
class RampTwiceAsLong(Ms2000):
    """Ramps take twice the ramp time."""

    def acceleration(self, axis: Axis) -> float:
        return super().acceleration(axis) / 2


@FAULTS.moves("ramp-time-acceleration")
class RampIndependentOfTopSpeed(Ms2000):
    """The acceleration does not depend on the top speed."""

    def acceleration(self, axis: Axis) -> float:
        return 60_000 / (axis.ramp_ms / 1000)


@FAULTS.moves("vector-speed-runs")
class VectorEnds(Ms2000):
    """A vector move ends after half a second."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        super().set_vector(axis, um_s)
        if um_s and axis.path.pieces:
            *ramps, steady = axis.path.pieces
            steady = replace(steady, lasts=min(steady.lasts, 0.5))
            x, acceleration = steady.position(steady.end), self.acceleration(axis)
            end = to_rest(steady.end, x, steady.v, acceleration)
            axis.path = Path((*ramps, steady, *end.pieces), end.rest)


@FAULTS.moves("vector-speed-runs")
class VectorNeverNegative(Ms2000):
    """A negative vector speed moves up."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        super().set_vector(axis, abs(um_s))


@FAULTS.moves("vector-speed-runs")
class VectorAtHalfSpeed(Ms2000):
    """A vector move runs at half the given speed."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        super().set_vector(axis, um_s // 2)


@FAULTS.moves("vector-speed-ramp", "ramp-time-acceleration")
class VectorWithoutARamp(Ms2000):
    """A vector move does not ramp."""

    def acceleration(self, axis: Axis) -> float:
        return 1e9 if axis.runs else super().acceleration(axis)


@FAULTS.moves(*BUSY)
class NeverBusy(Ms2000):
    """READ_STATUS returns b during motion."""

    def busy(self, axis: Axis) -> bool:
        return False


@FAULTS.moves(*BUSY)
class BusyTooLong(Ms2000):
    """READ_STATUS returns B for a long time after a move."""

    def busy(self, axis: Axis) -> bool:
        return self.now < axis.path.end + 20


@FAULTS.moves(*BUSY)
class NotBusyWhileRampingDown(Ms2000):
    """READ_STATUS returns b as soon as an axis ramps down."""

    def busy(self, axis: Axis) -> bool:
        return super().busy(axis) and self.ramping(axis) >= 0


@FAULTS.moves("disabled-not-busy", *BUSY)
class BusyWhileDisabled(Ms2000):
    """A disabled axis away from its target is busy."""

    def busy(self, axis: Axis) -> bool:
        return super().busy(axis) or abs(self.position(axis) - axis.target) > 1


@FAULTS.moves("status-moving-bit")
class MovingBitMissing(Ms2000):
    """Bit 0 of the status byte is always 0."""

    def status_byte(self, axis: Axis) -> int:
        return super().status_byte(axis) & ~0x01


@FAULTS.moves("status-ramping-bits")
class RampingBitMissing(Ms2000):
    """Bit 4 of the status byte is always 0."""

    def status_byte(self, axis: Axis) -> int:
        return super().status_byte(axis) & ~0x10


@FAULTS.moves("status-ramping-bits")
class RampingDirectionInverted(Ms2000):
    """Bit 5 of the status byte is 1 while an axis ramps up."""

    def ramping(self, axis: Axis) -> int:
        return -super().ramping(axis)


@FAULTS.moves("current-speed-reply")
class SpeedNeverNegative(Ms2000):
    """READ_CURRENT_SPEED returns the magnitude of the speed."""

    def current_speed(self, axis: Axis) -> int:
        return abs(super().current_speed(axis))


@FAULTS.moves("current-speed-reply")
class SpeedAlwaysZero(Ms2000):
    """READ_CURRENT_SPEED returns 0 during motion."""

    def current_speed(self, axis: Axis) -> int:
        return 0


@FAULTS.moves("stop-disables")
class StopIgnored(Ms2000):
    """STOP_MOTOR does not end a move."""

    def stop(self, axis: Axis) -> None:
        pass


@FAULTS.moves("stop-disables")
class StopOnlyPauses(Ms2000):
    """STOP_MOTOR stops an axis, but the next target moves it."""

    def stop(self, axis: Axis) -> None:
        super().stop(axis)
        axis.enabled = True


@FAULTS.moves("start-enables")
class StartIgnored(Ms2000):
    """START_MOTOR does not enable a stopped axis."""

    def start(self, axis: Axis) -> None:
        pass


@FAULTS.moves("target-moves", "target-written")
class StopsShort(Ms2000):
    """A move ends 3 µm before its target."""

    def path_to(self, axis: Axis, place: float) -> Path:
        side = math.copysign(30, place - self.place(axis))
        return super().path_to(axis, place - side)


@FAULTS.moves("axis-identifiers", "target-moves")
class OneAxisAtATime(Ms2000):
    """A new target stops the other axis."""

    def set_target(self, axis: Axis, target: int) -> None:
        for other in self.axes.values():
            if other is not axis:
                other.path = resting(self.place(other))
        super().set_target(axis, target)


@FAULTS.moves("target-moves")
class NewTargetIgnoredInMotion(Ms2000):
    """A new target during a move is stored, but the axis goes to the old one."""

    def approach(self, axis: Axis) -> None:
        if not self.moving(axis):
            super().approach(axis)


@FAULTS.moves("status-limit-bits")
class LimitBitsSwapped(Ms2000):
    """The status byte swaps the two limit switches."""

    def limits(self, axis: Axis) -> tuple[bool, bool]:
        upper, lower = super().limits(axis)
        return lower, upper


@FAULTS.moves("position-written")
class PositionMovesTheStage(Ms2000):
    """WRITE_MOTOR_POSITION moves the stage, like a target."""

    def set_position(self, axis: Axis, position: int) -> None:
        self.set_target(axis, position)


@FAULTS.moves("target-reply", "target-written")
class TargetIsThePosition(Ms2000):
    """READ_TARGET_POSITION returns the current position."""

    def target(self, axis: Axis) -> int:
        return self.position(axis)


@FAULTS.moves("position-reply", "position-and-status-reply")
class PositionOfTheTarget(Ms2000):
    """During a move, READ_MOTOR_POSITION returns the target."""

    def position(self, axis: Axis) -> int:
        if self.moving(axis) and axis.runs is None:
            return axis.target
        return super().position(axis)


@FAULTS.moves("axis-identifiers", "stop-disables")
class StopStopsBothAxes(Ms2000):
    """STOP_MOTOR stops and disables both axes."""

    def stop(self, axis: Axis) -> None:
        for each in self.axes.values():
            super().stop(each)


@FAULTS.moves("axis-identifiers", "stop-disables")
class StopHaltsBothAxes(Ms2000):
    """STOP_MOTOR also ends the motion of the other axis, which stays enabled."""

    def stop(self, axis: Axis) -> None:
        super().stop(axis)
        for each in self.axes.values():
            each.path = resting(self.place(each))


@FAULTS.moves("axis-identifiers", "stop-disables")
class StopOfTheFirstAxis(Ms2000):
    """STOP_MOTOR always stops the first axis."""

    def stop(self, axis: Axis) -> None:
        super().stop(self.axes[24])


@FAULTS.moves("vector-speed-runs")
class SecondVectorIgnored(Ms2000):
    """During a vector move, another vector speed is ignored."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        if not (axis.runs and um_s and self.moving(axis)):
            super().set_vector(axis, um_s)


@FAULTS.moves("vector-speed-runs")
class VectorsAdded(Ms2000):
    """During a vector move, another vector speed is added to the first one."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        before = round((axis.runs or 0) / 10) if self.moving(axis) and um_s else 0
        super().set_vector(axis, before + um_s)


@FAULTS.moves("vector-speed-runs", "axis-identifiers")
class VectorOfBothAxes(Ms2000):
    """A vector speed also applies to the other axis while that makes a vector move."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        super().set_vector(axis, um_s)
        for each in self.axes.values():
            if each is not axis and each.runs and um_s:
                super().set_vector(each, um_s)


@FAULTS.moves("vector-speed-runs")
class VectorAlongThePath(Ms2000):
    """While both axes make vector moves, each is slower by the square root of two."""

    def set_vector(self, axis: Axis, um_s: int) -> None:
        others = [each for each in self.axes.values() if each is not axis and each.runs]
        super().set_vector(axis, round(um_s / math.sqrt(2)) if others else um_s)
        for each in others if um_s else ():
            super().set_vector(each, round((each.runs or 0) / 10 / math.sqrt(2)))

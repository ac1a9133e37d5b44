"""Faults of motion in the TDC001 of the corpus."""

from __future__ import annotations

import math

from corpus_faults import Faults
from corpus_motion import Path, then, to_rest
from corpus_motor import HOME, MOVE, RUN
from corpus_tdc001 import Tdc001

FAULTS = Faults()


@FAULTS.moves("velocity-parameters")
class AccelerationIgnored(Tdc001):
    """Moves always use the default acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        return self.SETTINGS["velocity"].values[1], super().velocity_parameters()[1]


@FAULTS.moves("velocity-parameters")
class CapOfTheFactory(Tdc001):
    """Moves always use the default maximum velocity."""

    def velocity_parameters(self) -> tuple[float, float]:
        return super().velocity_parameters()[0], self.SETTINGS["velocity"].values[2]


@FAULTS.moves("velocity-parameters")
class CapIgnoredByAbsoluteMoves(Tdc001):
    """Absolute moves run at three times the maximum velocity."""

    def move_absolute(self, position: int) -> None:
        acceleration, speed = self.velocity_parameters()
        self.move_to(self.axis.zero + position, MOVE, acceleration, 3 * speed)


@FAULTS.moves("velocity-parameters", "velocity-move-until-stop")
class CapIgnoredByVelocityMoves(Tdc001):
    """MOVE_VELOCITY runs at four times the maximum velocity."""

    def move_velocity(self, direction: int) -> None:
        acceleration, speed = self.velocity_parameters()
        side = 1 if direction == 1 else -1
        self.go(RUN, self.running(4 * side * speed, acceleration))


@FAULTS.moves("relative-move", "relative-move-long")
class RelativeFromTheOldTarget(Tdc001):
    """A relative move after a stop begins at the target of the stopped move."""

    old: float | None = None

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        self.old = target
        super().move_to(target, motion, acceleration, speed)

    def move_velocity(self, direction: int) -> None:
        self.old = None
        super().move_velocity(direction)

    def move_home(self, frame: bytes) -> None:
        self.old = None
        super().move_home(frame)

    def move_relative(self, distance: int) -> None:
        start = self.place() if self.old is None else self.old
        self.move_to(start + distance, MOVE, *self.velocity_parameters())


@FAULTS.moves("relative-move-long", "relative-move")
class RelativeTwiceAsFar(Tdc001):
    """A relative move goes twice the distance."""

    def move_relative(self, distance: int) -> None:
        super().move_relative(2 * distance)


@FAULTS.moves("relative-move-short")
class StoredDistanceIgnored(Tdc001):
    """The short relative move uses the default distance, not the stored one."""

    def stored_distance(self) -> int:
        return self.SETTINGS["relative"].values[0]


@FAULTS.moves("absolute-move-short")
class StoredPositionIgnored(Tdc001):
    """The short absolute move repeats the position of the last long one."""

    last = 0

    def stored_position(self) -> int:
        return self.last

    def move_absolute(self, position: int) -> None:
        self.last = position
        super().move_absolute(position)


@FAULTS.moves("absolute-move-long", "absolute-move", "move-completed")
class EndsShort(Tdc001):
    """Every move ends 200 counts before its target."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        side = math.copysign(200, target - self.place())
        super().move_to(target - side, motion, acceleration, speed)


@FAULTS.moves("jog-continuous")
class ContinuousJogIgnored(Tdc001):
    """A jog in continuous mode makes a single step."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        return 2, *super().jog_parameters()[1:]


@FAULTS.moves("jog-single-step")
class SingleStepRunsOn(Tdc001):
    """A jog in single step mode does not stop after its step."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        return 1, *super().jog_parameters()[1:]


@FAULTS.moves("jog-single-step")
class JogStepIgnored(Tdc001):
    """A jog always uses the default step."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, _, acceleration, speed = super().jog_parameters()
        return mode, self.SETTINGS["jog"].values[1], acceleration, speed


@FAULTS.moves("jog-parameters")
class JogAtMoveVelocity(Tdc001):
    """Jogs use the velocity parameters of moves."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        return *super().jog_parameters()[:2], *self.velocity_parameters()


@FAULTS.moves("jog-direction-values", "jog-move")
class JogAlwaysForward(Tdc001):
    """A jog in reverse goes forward."""

    def move_jog(self, direction: int) -> None:
        super().move_jog(1)


@FAULTS.moves("velocity-direction-values", "velocity-move")
class VelocityMoveAlwaysForward(Tdc001):
    """MOVE_VELOCITY in reverse goes forward."""

    def move_velocity(self, direction: int) -> None:
        super().move_velocity(1)


@FAULTS.moves("stop-any-move")
class ProfiledStopIgnored(Tdc001):
    """A profiled stop has no effect, and is reported at once."""

    def move_stop(self, mode: int) -> None:
        if mode == 1:
            super().move_stop(mode)
        else:
            self.report_stopped()


@FAULTS.moves("stop-any-move")
class StopDoesNotEndHoming(Tdc001):
    """A stop does not end homing."""

    def move_stop(self, mode: int) -> None:
        if self.axis.motion == HOME:
            self.report_stopped()
        else:
            super().move_stop(mode)


@FAULTS.moves("stop-mode-values")
class StopModesSwapped(Tdc001):
    """An immediate stop slows down, and a profiled stop is abrupt."""

    def move_stop(self, mode: int) -> None:
        super().move_stop(3 - mode)


@FAULTS.moves("stop-completed")
class StoppedBeforeRest(Tdc001):
    """MOVE_STOPPED is sent as soon as a profiled stop begins."""

    def move_stop(self, mode: int) -> None:
        if mode == 2 and self.axis.motion:
            super().report_stopped()
        super().move_stop(mode)

    def arrive(self) -> None:
        if self.axis.stopping:
            self.halt()
        else:
            super().arrive()


@FAULTS.moves("stop-completed", "velocity-move-completed")
class StopSendsCompleted(Tdc001):
    """A stop ends with MOVE_COMPLETED instead of MOVE_STOPPED."""

    def report_stopped(self) -> None:
        self.report_completed()


@FAULTS.moves("home-parameters", "home-starts")
class HomeVelocityIgnored(Tdc001):
    """Homing always uses the default velocity."""

    def home_parameters(self) -> tuple[float, float]:
        return self.SETTINGS["home"].values[2], super().home_parameters()[1]


@FAULTS.moves("position-after-homing", "position-counter-absolute", "encoder-counter-after-homing")
class HomedWithoutAPosition(Tdc001):
    """Homing does not change the position counter."""

    def arrive(self) -> None:
        zero, homing = self.axis.zero, self.axis.motion == HOME
        super().arrive()
        self.axis.zero = zero if homing else self.axis.zero


@FAULTS.moves("home-completed")
class HomedAtOnce(Tdc001):
    """MOVE_HOMED is sent when homing begins."""

    def move_home(self, frame: bytes) -> None:
        super().move_home(frame)
        if self.axis.motion:
            super().send_end(0x0444)

    def send_end(self, id: int, packet: bytes = b"") -> None:
        if id != 0x0444:
            super().send_end(id, packet)


@FAULTS.moves("velocity-move-until-limit")
class LimitSwitchIgnored(Tdc001):
    """The stage runs past its limit switches."""

    def span(self) -> tuple[float, float]:
        return -math.inf, math.inf


@FAULTS.moves("velocity-move-completed")
class SilentAtTheLimit(Tdc001):
    """A velocity move ends at a limit switch without a message."""

    def arrive(self) -> None:
        if self.axis.motion == RUN and not self.axis.stopping:
            self.halt()
        else:
            super().arrive()


@FAULTS.moves("position-counter-set")
class CounterMovesTheStage(Tdc001):
    """SET_POSCOUNTER moves the stage to the given position."""

    def set_position(self, frame: bytes) -> None:
        target = self.axis.zero + self.number(frame)
        self.move_to(target, MOVE, *self.velocity_parameters())


@FAULTS.moves("channel-enable")
class MovesWhileDisabled(Tdc001):
    """Disabling the channel changes its enable state, but does not end a motion."""

    def halt(self) -> None:
        if self.axis.enabled or self.axis.path.end <= self.now:
            super().halt()


@FAULTS.moves("velocity-move-until-stop")
class VelocityMoveEnds(Tdc001):
    """MOVE_VELOCITY stops by itself after 0.4 s."""

    def move_velocity(self, direction: int) -> None:
        super().move_velocity(direction)
        if self.axis.motion == RUN:
            stop = self.now + 0.4
            x, v = self.axis.path.position(stop), self.axis.path.speed(stop)
            first = Path(self.axis.path.pieces, x)
            end = to_rest(stop, x, v, self.velocity_parameters()[0])
            kept = tuple(
                type(piece)(
                    piece.start, min(piece.lasts, stop - piece.start), piece.x, piece.v, piece.a
                )
                for piece in first.pieces
                if piece.start < stop
            )
            self.go(RUN, then(Path(kept, x), end))


@FAULTS.moves("absolute-move-long", "absolute-move")
class EndsTooFar(Tdc001):
    """A move runs 2 % too far."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        place = self.place()
        super().move_to(place + 1.02 * (target - place), motion, acceleration, speed)

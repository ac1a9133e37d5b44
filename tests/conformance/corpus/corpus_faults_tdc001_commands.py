"""Faults of commands that follow others, or arrive during a motion, in the TDC001 of the corpus."""

from __future__ import annotations

import math

from corpus_faults import Faults
from corpus_motion import Path
from corpus_motor import HOME, JOG, MOVE, RUN
from corpus_tdc001 import ShortTdc001, Tdc001

FAULTS = Faults()
SHORT = Faults()
"""Faults of an actuator with both ends within the allowed range."""


@FAULTS.moves("absolute-move-completed", "relative-move-completed", "stop-completed")
class StopAtRestIsKept(Tdc001):
    """A stop at rest also ends the next move with MOVE_STOPPED."""

    kept_stop = False

    def move_stop(self, mode: int) -> None:
        self.kept_stop = not self.axis.motion
        super().move_stop(mode)

    def arrive(self) -> None:
        self.axis.stopping |= self.kept_stop and self.axis.motion == MOVE
        self.kept_stop = False
        super().arrive()


@FAULTS.moves("absolute-move", "absolute-move-completed", "relative-move", "stop-any-move")
class StopAtRestHoldsTheMotor(Tdc001):
    """After a stop at rest, the next move ends where it begins."""

    held = False

    def move_stop(self, mode: int) -> None:
        self.held = not self.axis.motion
        super().move_stop(mode)

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        held, self.held = self.held, False
        super().move_to(self.place() if held else target, motion, acceleration, speed)


@FAULTS.moves("stop-any-move")
class StopIgnoredInTheBacklash(Tdc001):
    """A stop has no effect while the motor comes back to correct the backlash."""

    turns_at = math.inf

    def go(self, motion: str, path: Path) -> None:
        signs = [math.copysign(1, piece.v or piece.a) for piece in path.pieces]
        back = [
            piece.start
            for piece, sign in zip(path.pieces, signs, strict=True)
            if motion == MOVE and sign != signs[0]
        ]
        self.turns_at = min(back, default=math.inf)
        super().go(motion, path)

    def move_stop(self, mode: int) -> None:
        if not self.axis.motion or self.now < self.turns_at:
            super().move_stop(mode)


@FAULTS.moves("stop-mode-values")
class ImmediateStopOfARunSlowsDown(Tdc001):
    """An immediate stop ends a velocity move with a profile."""

    def move_stop(self, mode: int) -> None:
        super().move_stop(2 if self.axis.motion == RUN else mode)


@FAULTS.moves("stop-mode-values")
class ProfiledStopOfAJogIsAbrupt(Tdc001):
    """A profiled stop ends a jog abruptly."""

    def move_stop(self, mode: int) -> None:
        super().move_stop(1 if self.axis.motion == JOG else mode)


@FAULTS.moves("stop-any-move")
class ImmediateStopOfARunIgnored(Tdc001):
    """An immediate stop does not end a velocity move, but is reported."""

    def move_stop(self, mode: int) -> None:
        if self.axis.motion == RUN and mode == 1:
            self.report_stopped()
        else:
            super().move_stop(mode)


@FAULTS.moves("absolute-move-completed")
class NoEndWithoutADistance(Tdc001):
    """A move to the present position is not reported."""

    def move_absolute(self, position: int) -> None:
        if position != self.position():
            super().move_absolute(position)


@FAULTS.moves("velocity-parameters")
class RunsThirtyPerCentTooFast(Tdc001):
    """A velocity move runs 30 % above the maximum velocity."""

    def running(self, speed: float, acceleration: float) -> Path:
        faster = 1.3 if self.axis.motion != JOG else 1.0
        return super().running(faster * speed, acceleration)


@FAULTS.breaks("encoder-counter-after-homing")
class EncoderFrozenInMotion(Tdc001):
    """GET_ENCCOUNTER repeats the count from the beginning of a motion until its end."""

    frozen = 0

    def go(self, motion: str, path: Path) -> None:
        self.frozen = self.encoder()
        super().go(motion, path)

    def encoder(self) -> int:
        return self.frozen if self.axis.motion else super().encoder()


@FAULTS.breaks("dc-status-position")
class StatusShowsTheEncoder(Tdc001):
    """The status has the encoder count instead of the position count."""

    def position_in_status(self) -> int:
        return self.encoder()


@FAULTS.breaks("status-updates-position")
class UpdatesShowTheEncoder(Tdc001):
    """Status updates, but not requested statuses, have the encoder count instead of the position count."""

    updating = False

    def send_update(self) -> None:
        self.updating = True
        super().send_update()
        self.updating = False

    def position_in_status(self) -> int:
        return self.encoder() if self.updating else self.position()


@FAULTS.moves("position-counter-set", "absolute-move", "absolute-move-long")
class TargetsIgnoreTheCounter(Tdc001):
    """After SET_POSCOUNTER, absolute moves still count from the zero before."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)  # type: ignore[arg-type]
        self.zero_of_targets = self.axis.zero

    def arrive(self) -> None:
        homes = self.axis.homed
        super().arrive()
        if self.axis.homed and not homes:
            self.zero_of_targets = self.axis.zero

    def move_absolute(self, position: int) -> None:
        shift = self.zero_of_targets - self.axis.zero
        super().move_absolute(position + round(shift))


@FAULTS.moves("absolute-move")
class SecondMoveIgnored(Tdc001):
    """A move that is commanded during a move is ignored."""

    def move_absolute(self, position: int) -> None:
        if not self.axis.motion:
            super().move_absolute(position)


@FAULTS.moves("absolute-move")
class TurnsTooLate(Tdc001):
    """A move that turns a moving motor round ends beyond its target by the distance for slowing down."""

    def move_absolute(self, position: int) -> None:
        speed, (acceleration, _) = self.speed(), self.velocity_parameters()
        super().move_absolute(position + round(speed * abs(speed) / acceleration / 2))


@FAULTS.breaks("velocity-parameters")
class SetIgnoredInMotion(Tdc001):
    """A SET during a motion is ignored."""

    def set(self, name: str, frame: bytes) -> None:
        if not self.axis.motion:
            super().set(name, frame)


@FAULTS.moves("velocity-parameters")
class SetEndsTheMotion(Tdc001):
    """MOT_SET_VELPARAMS during a motion stops the motor without a message."""

    def set(self, name: str, frame: bytes) -> None:
        super().set(name, frame)
        if name == "velocity":
            self.halt()


@FAULTS.breaks("updates-stop")
class UpdatesStopOnlyAtRest(Tdc001):
    """HW_STOP_UPDATEMSGS has no effect during a motion."""

    def stop_updates(self, frame: bytes) -> None:
        if not self.axis.motion:
            super().stop_updates(frame)


@FAULTS.moves("jog-move", "jog-single-step", "jog-parameters")
class JogStepOfSixteenBits(Tdc001):
    """A jog covers the lower 16 bits of its step."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, int(step) & 0xFFFF, acceleration, speed


@FAULTS.breaks("dc-status-velocity")
class VelocityOfTheSetting(Tdc001):
    """The status reports the maximum velocity during all of a motion, also while the motor speeds up."""

    def reported_velocity(self) -> int:
        speed = super().speed()
        _, most = self.velocity_parameters()
        return round(math.copysign(most, speed) / 34304 * 204.8) if speed else 0


@FAULTS.breaks("encoder-counter-set")
class EncoderSetsBothCounters(Tdc001):
    """SET_ENCCOUNTER also sets the position counter."""

    def set_encoder(self, frame: bytes) -> None:
        super().set_encoder(frame)
        self.set_position(frame)


@FAULTS.moves("velocity-parameters", "jog-parameters")
class JogParametersRemain(Tdc001):
    """After a jog, moves use the velocity and the acceleration of jogs until MOT_SET_VELPARAMS."""

    jogged = False

    def move_jog(self, direction: int) -> None:
        self.jogged = True
        super().move_jog(direction)

    def set(self, name: str, frame: bytes) -> None:
        if name == "velocity":
            self.jogged = False
        super().set(name, frame)

    def velocity_parameters(self) -> tuple[float, float]:
        if not self.jogged:
            return super().velocity_parameters()
        _, _, acceleration, speed = self.jog_parameters()
        return acceleration, speed


@SHORT.moves("velocity-move-until-limit")
class ForwardSwitchIgnored(ShortTdc001):
    """The forward limit switch does not stop a motion."""

    def span(self) -> tuple[float, float]:
        low, high = super().span()
        return low, high if high < self.SPAN else math.inf


@SHORT.breaks("dc-status-bits-limits")
class ForwardSwitchNotReported(ShortTdc001):
    """The status does not report the forward limit switch."""

    def limit_bits(self) -> int:
        return super().limit_bits() & 2


@FAULTS.moves("velocity-parameters")
class ReverseAtHalfSpeed(Tdc001):
    """Moves in reverse run at half the maximum velocity."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        slower = 0.5 if motion == MOVE and target < self.place() else 1.0
        super().move_to(target, motion, acceleration, slower * speed)


@FAULTS.breaks("dc-status-bits-limits")
class LimitBitStays(Tdc001):
    """The status reports a limit switch forever once it was active."""

    touched = 0

    def limit_bits(self) -> int:
        self.touched |= super().limit_bits()
        return self.touched


@FAULTS.breaks("relative-move-long")
class RelativeMovesOfSixteenBits(Tdc001):
    """A relative move uses the lower 16 bits of its distance, as a signed number."""

    def move_relative(self, distance: int) -> None:
        super().move_relative((distance + 0x8000) % 0x10000 - 0x8000)


@FAULTS.moves("stop-completed", "home-completed")
class StoppedHomingSendsHomed(Tdc001):
    """A stop in homing is reported with MOVE_HOMED and MOVE_STOPPED."""

    def arrive(self) -> None:
        if self.axis.motion == HOME and self.axis.stopping:
            self.send_end(0x0444)
        super().arrive()

"""Faults of motion in the stepper controller of the corpus."""

from __future__ import annotations

import struct

from corpus_faults import Faults
from corpus_motion import Path, to_rest, to_target
from corpus_motor import HOME, JOG, MOVE, RUN
from corpus_stepper import Stepper

FAULTS = Faults()
ANSWERED = ("request-answered", "get-answers-request")
MOTION_BITS = ("status-bits-motion", "status-bits-meaning")


@FAULTS.moves("absolute-move-long", "absolute-move", "relative-move-long", "relative-move")
class BacklashNotTakenUp(Stepper):
    """A move in reverse ends beyond its target, by the backlash distance."""

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        backlash = self.kept("general")[0]
        target -= backlash if (target - self.place()) * backlash < 0 else 0
        place, v = self.place(), self.speed()
        self.go(motion, to_target(self.now, place, v, target, speed, acceleration))


@FAULTS.moves("velocity-parameters")
class TopSpeedDoubled(Stepper):
    """All moves run at twice the maximum velocity."""

    def velocity_parameters(self) -> tuple[float, float]:
        acceleration, speed = super().velocity_parameters()
        return acceleration, 2 * speed


@FAULTS.moves("velocity-parameters")
class NoRamp(Stepper):
    """Moves begin and end abruptly, whatever the acceleration."""

    def velocity_parameters(self) -> tuple[float, float]:
        return 1e9, super().velocity_parameters()[1]

    def stop_deceleration(self) -> float:
        return self.kept("velocity")[1]


@FAULTS.moves("jog-parameters")
class JogAccelerationIgnored(Stepper):
    """Jogs use a twentieth of their acceleration."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration / 20, speed


@FAULTS.moves("jog-parameters")
class JogHalfAsFast(Stepper):
    """Jogs run at half their maximum velocity."""

    def jog_parameters(self) -> tuple[int, float, float, float]:
        mode, step, acceleration, speed = super().jog_parameters()
        return mode, step, acceleration, speed / 2


@FAULTS.moves("velocity-move-until-stop")
class VelocityMoveMakesAStep(Stepper):
    """MOVE_VELOCITY makes one step."""

    def move_velocity(self, direction: int) -> None:
        step = 10240 if direction == 1 else -10240
        self.move_to(self.place() + step, RUN, *self.velocity_parameters())


@FAULTS.moves("absolute-move", "absolute-move-long")
class AbsoluteFromHere(Stepper):
    """An absolute move adds its position to the current one."""

    def move_absolute(self, position: int) -> None:
        self.move_relative(position)


@FAULTS.moves("relative-move-long", "relative-move")
class RelativeAlwaysForward(Stepper):
    """A relative move ignores the sign of its distance."""

    def move_relative(self, distance: int) -> None:
        super().move_relative(abs(distance))


@FAULTS.moves("relative-move", "relative-move-long", "relative-move-short")
class LongMoveUsesStoredDistance(Stepper):
    """The long relative move uses the stored distance."""

    def number(self, frame: bytes) -> int:
        return self.stored_distance() if frame[:2] == b"\x48\x04" else super().number(frame)


@FAULTS.moves("home-starts", "home-completed", "position-after-homing")
class HomesOnPaper(Stepper):
    """MOVE_HOME does not move the stage, and is reported as completed."""

    def move_home(self, frame: bytes) -> None:
        self.go(HOME, Path((), self.place()))


@FAULTS.moves("home-parameters", "home-starts")
class HomesAtMoveVelocity(Stepper):
    """Homing uses the maximum velocity of moves."""

    def home_parameters(self) -> tuple[float, float]:
        return self.velocity_parameters()[1], super().home_parameters()[1]


@FAULTS.moves(*MOTION_BITS)
class NeverHomed(Stepper):
    """The status never reports the stage as homed."""

    def status_bits(self) -> int:
        return super().status_bits() & ~0x400


@FAULTS.moves(*MOTION_BITS)
class HomedWhileHoming(Stepper):
    """The status reports an earlier homing as completed while the stage homes again."""

    was_homed = False

    def status_bits(self) -> int:
        bits = super().status_bits()
        self.was_homed = self.was_homed or bool(bits & 0x400)
        return bits & ~0x200 | (0x400 if self.was_homed else 0)


@FAULTS.moves("stop-completed")
class StoppedNotSent(Stepper):
    """MOVE_STOPPED is never sent."""

    def report_stopped(self) -> None:
        pass


@FAULTS.moves("stop-mode-values", "stop-any-move")
class ImmediateStopSlow(Stepper):
    """An immediate stop slows down even longer than a profiled one."""

    def move_stop(self, mode: int) -> None:
        if mode == 1 and self.axis.motion:
            x, v = self.place(), self.speed()
            path = to_rest(self.now, x, v, self.stop_deceleration() / 2)
            self.axis.path, self.axis.stopping = path.within(0, self.SPAN), True
            self.catch_up()
        else:
            super().move_stop(mode)


@FAULTS.moves("stop-completed", "move-stopped-status")
class StoppedShowsTheTarget(Stepper):
    """MOVE_STOPPED contains the position that the stopped move should have reached."""

    target = 0.0

    def go(self, motion: str, path: Path) -> None:
        self.target = path.rest
        super().go(motion, path)

    def report_stopped(self) -> None:
        status = bytearray(self.status_packet())
        target = round(self.target - self.axis.zero)
        status[2:6] = target.to_bytes(4, "little", signed=True)
        self.send_end(0x0466, bytes(status))


@FAULTS.moves("jog-move-completed")
class JogsNotCompleted(Stepper):
    """A jog ends without MOVE_COMPLETED."""

    def arrive(self) -> None:
        if self.axis.motion == JOG and not self.axis.stopping:
            self.halt()
        else:
            super().arrive()


@FAULTS.moves("velocity-move-completed")
class LimitReportedAsStop(Stepper):
    """A velocity move that ends at a limit switch is reported with MOVE_STOPPED."""

    def arrive(self) -> None:
        self.axis.stopping = self.axis.stopping or self.axis.motion == RUN
        super().arrive()


@FAULTS.moves("status-bits-limits")
class LimitBitsSwapped(Stepper):
    """The status swaps the two hardware limit switches."""

    def limit_bits(self) -> int:
        bits = super().limit_bits()
        return (bits & 1) << 1 | bits >> 1


@FAULTS.moves(*MOTION_BITS)
class BothDirections(Stepper):
    """The status reports motion in both directions at once."""

    def status_bits(self) -> int:
        return super().status_bits() | (0x30 if self.axis.motion else 0)


@FAULTS.moves("end-messages-suspended", *ANSWERED)
class SuspendSilencesStatus(Stepper):
    """While end-of-move messages are suspended, no status request is answered."""

    def request_status(self, frame: bytes) -> None:
        if not self.suspended:
            super().request_status(frame)


@FAULTS.moves("status-position")
class PositionLags(Stepper):
    """During motion, the status reports the position of 0.4 s before."""

    def status_packet(self) -> bytes:
        now = self.now
        if self.axis.path.pieces:
            self.now = max(self.axis.path.pieces[0].start, now - 0.4)
        position = self.position()
        self.now = now
        status = super().status_packet()
        return status[:2] + struct.pack("<i", position) + status[6:]


@FAULTS.moves("relative-move-completed", "move-completed", "absolute-move-completed")
class CompletedTwice(Stepper):
    """MOVE_COMPLETED is sent twice."""

    def report_completed(self) -> None:
        super().report_completed()
        super().report_completed()


@FAULTS.moves("position-counter-set", "absolute-move", "absolute-move-long")
class CounterNotUsedByMoves(Stepper):
    """After SET_POSCOUNTER, absolute moves still use the old counter."""

    old_zero: float | None = None

    def set_position(self, frame: bytes) -> None:
        self.old_zero = self.axis.zero if self.old_zero is None else self.old_zero
        super().set_position(frame)

    def move_absolute(self, position: int) -> None:
        zero = self.axis.zero if self.old_zero is None else self.old_zero
        self.move_to(zero + position, MOVE, *self.velocity_parameters())


@FAULTS.moves("move-completed", "absolute-move-completed", "relative-move-completed")
class SmallMovesNotCompleted(Stepper):
    """A move of less than 2000 microsteps ends without MOVE_COMPLETED."""

    small = False

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        self.small = motion == MOVE and abs(target - self.place()) < 2000
        super().move_to(target, motion, acceleration, speed)

    def report_completed(self) -> None:
        if not self.small:
            super().report_completed()

"""Faults of the messages about motion in the TDC001 of the corpus."""

from __future__ import annotations

import math

from corpus_faults import Faults
from corpus_motion import Path
from corpus_motor import JOG, MOVE
from corpus_tdc001 import Tdc001

FAULTS = Faults()
ANY_STATUS = ("dc-status-bits", "dc-status-bits-motion")


@FAULTS.moves("dc-status-velocity")
class VelocityNeverNegative(Tdc001):
    """The status reports the magnitude of the velocity."""

    def reported_velocity(self) -> int:
        return abs(super().reported_velocity())


@FAULTS.moves("dc-status-velocity")
class VelocityInverted(Tdc001):
    """The status reports the velocity with the wrong sign."""

    def reported_velocity(self) -> int:
        return -super().reported_velocity()


@FAULTS.moves("dc-status-velocity")
class VelocityAlwaysZero(Tdc001):
    """The status reports no velocity during a motion."""

    def reported_velocity(self) -> int:
        return 0


@FAULTS.moves("dc-status-velocity")
class VelocityStaysAfterTheMove(Tdc001):
    """The status keeps reporting the last velocity after a motion has ended."""

    last = 0

    def reported_velocity(self) -> int:
        self.last = super().reported_velocity() or self.last
        return self.last


@FAULTS.moves("absolute-move-completed", "move-completed", "relative-move-completed")
class CompletedEarly(Tdc001):
    """MOVE_COMPLETED is sent after four fifths of a move, before its end."""

    early = math.inf

    def go(self, motion: str, path: Path) -> None:
        if motion == MOVE and self.axis.enabled and path.pieces:
            self.early = self.now + 0.8 * (path.end - self.now)
        super().go(motion, path)

    def due(self) -> float:
        return min(self.early, super().due())

    def catch_up(self) -> None:
        if self.early <= self.clock():
            self.now, self.early = self.early, math.inf
            super().report_completed()
        super().catch_up()

    def report_completed(self) -> None:
        """It was sent before."""


@FAULTS.moves("absolute-move-completed", "move-completed", "relative-move-completed")
class CompletedAtOnce(Tdc001):
    """MOVE_COMPLETED is sent when a move begins."""

    def go(self, motion: str, path: Path) -> None:
        super().go(motion, path)
        if motion == MOVE and self.axis.motion:
            super().report_completed()

    def report_completed(self) -> None:
        if self.axis.motion == JOG:
            super().report_completed()


@FAULTS.moves("move-completed-status", "absolute-move-completed")
class CompletedWithTheStart(Tdc001):
    """MOVE_COMPLETED contains the position at the start of the move."""

    began = 0

    def go(self, motion: str, path: Path) -> None:
        self.began = self.position()
        super().go(motion, path)

    def report_completed(self) -> None:
        status = bytearray(self.status_packet())
        status[2:6] = self.began.to_bytes(4, "little", signed=True)
        self.send_end(0x0464, bytes(status))


@FAULTS.moves("end-messages-suspended")
class SuspendHidesOnlyCompleted(Tdc001):
    """While end-of-move messages are suspended, MOVE_STOPPED and MOVE_HOMED are still sent."""

    def send_end(self, id: int, packet: bytes = b"") -> None:
        suspended, self.suspended = self.suspended, self.suspended and id == 0x0464
        super().send_end(id, packet)
        self.suspended = suspended


@FAULTS.moves("end-messages-suspended")
class SuspendIgnored(Tdc001):
    """SUSPEND_ENDOFMOVEMSGS has no effect."""

    def suspend(self, on: bool) -> None:
        self.suspended = False


@FAULTS.moves("end-messages-resumed")
class ResumeIgnored(Tdc001):
    """RESUME_ENDOFMOVEMSGS has no effect."""

    def suspend(self, on: bool) -> None:
        self.suspended = self.suspended or on


@FAULTS.moves("status-bits-same")
class StatusBitsNeverHomed(Tdc001):
    """GET_STATUSBITS does not report that homing was completed."""

    def request_status_bits(self, frame: bytes) -> None:
        homed, self.axis.homed = self.axis.homed, False
        super().request_status_bits(frame)
        self.axis.homed = homed


@FAULTS.moves("status-bits-same")
class StatusBitsOfTheLastUpdate(Tdc001):
    """GET_STATUSBITS returns the bits of the last status message."""

    last = 0x80003000

    def status_packet(self) -> bytes:
        self.last = self.status_bits()
        return super().status_packet()

    def request_status_bits(self, frame: bytes) -> None:
        bits = (1).to_bytes(2, "little") + self.last.to_bytes(4, "little")
        self.send_packet(0x042A, bits, frame[5])


@FAULTS.moves(*ANY_STATUS, "settled-at-rest")
class SettledInMotion(Tdc001):
    """The status reports the axis as settled during motion."""

    def status_bits(self) -> int:
        return super().status_bits() | 0x2000


@FAULTS.moves(*ANY_STATUS)
class MotionBitsSwapped(Tdc001):
    """The status reports motion in the opposite direction."""

    def motion_bits(self, moving: tuple[int, int]) -> int:
        return super().motion_bits(moving[::-1])


@FAULTS.moves(*ANY_STATUS)
class NoMotionBits(Tdc001):
    """The status reports no motion during moves."""

    def motion_bits(self, moving: tuple[int, int]) -> int:
        return 0


@FAULTS.moves(*ANY_STATUS)
class MotionBitsStay(Tdc001):
    """The status reports forward motion forever after the first move."""

    moved = False

    def go(self, motion: str, path: Path) -> None:
        super().go(motion, path)
        self.moved = True

    def status_bits(self) -> int:
        return super().status_bits() | (0x10 if self.moved else 0)


@FAULTS.moves(*ANY_STATUS)
class JogsReportedAsMoves(Tdc001):
    """The status reports a jog as a move."""

    def status_bits(self) -> int:
        bits = super().status_bits()
        return bits & ~0xC0 | (bits & 0xC0) >> 2


@FAULTS.moves(*ANY_STATUS)
class HomingNotReported(Tdc001):
    """The status does not report that the stage is homing."""

    def status_bits(self) -> int:
        return super().status_bits() & ~0x200


@FAULTS.moves("dc-status-bits-limits")
class LimitSwitchNotReported(Tdc001):
    """The status does not report an active limit switch."""

    def limit_bits(self) -> int:
        return 0


@FAULTS.moves("dc-status-position", "position-counter-absolute")
class StatusShowsTheTarget(Tdc001):
    """During a move, the status reports the target as the position."""

    def status_packet(self) -> bytes:
        status = bytearray(super().status_packet())
        if self.axis.motion == MOVE:
            target = round(self.axis.path.rest - self.axis.zero)
            status[2:6] = target.to_bytes(4, "little", signed=True)
        return bytes(status)


@FAULTS.moves("status-updates-position", "updates-content")
class UpdatesFrozenInMotion(Tdc001):
    """During a move, status updates repeat the position from before it."""

    before = b""

    def send_update(self) -> None:
        status = self.status_packet()
        if not self.axis.motion:
            self.before = status[2:6]
        self.send_status(self.STATUS, status[:2] + self.before + status[6:])


@FAULTS.moves("status-updates-periodic", "updates-until-stop")
class UpdatesPauseInMotion(Tdc001):
    """Status updates pause during motion."""

    def send_update(self) -> None:
        if not self.axis.motion:
            super().send_update()


@FAULTS.breaks("status-updates-every-100-ms", "status-updates-periodic")
class UpdatesSlow(Tdc001):
    """Status updates are sent once a second, whatever the rate."""

    def start_updates(self, frame: bytes) -> None:
        super().start_updates(frame)
        self.updates_every = 1.0


@FAULTS.breaks("updates-until-stop", "status-updates-periodic")
class UpdatesEnd(Tdc001):
    """Status updates end after ten messages."""

    left = 0

    def start_updates(self, frame: bytes) -> None:
        super().start_updates(frame)
        self.left = 10

    def send_update(self) -> None:
        self.left -= 1
        super().send_update()
        if not self.left:
            self.next_update = math.inf


@FAULTS.breaks("updates-stop")
class UpdatesNotStopped(Tdc001):
    """HW_STOP_UPDATEMSGS has no effect."""

    def stop_updates(self, frame: bytes) -> None:
        pass


@FAULTS.breaks("updates-start", "updates-stop", "updates-requestable", "status-updates-periodic")
class OneUpdateOnly(Tdc001):
    """HW_START_UPDATEMSGS sends one status message and no more."""

    def send_update(self) -> None:
        super().send_update()
        self.next_update = math.inf

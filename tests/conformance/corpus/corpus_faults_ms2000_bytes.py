"""Faults of bytes and settings in the MS-2000 of the corpus."""

from __future__ import annotations

import math

from corpus_faults import Faults
from corpus_ms2000 import COLON, WRITES, Axis, Ms2000

FAULTS = Faults()


@FAULTS.breaks("data-order", "position-reply", "twos-complement", "position-and-status-reply")
class PositionBigEndian(Ms2000):
    """Positions are sent most significant byte first."""

    def three(self, value: int) -> bytes:
        return value.to_bytes(3, "big", signed=True)


@FAULTS.breaks("twos-complement", "position-written", "position-reply", "data-order")
class PositionNeverNegative(Ms2000):
    """READ_MOTOR_POSITION returns the magnitude of the position."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return self.three(abs(self.position(axis))) if name == "a" else super().answer(axis, name)


@FAULTS.breaks("position-size", "position-reply", "size-of-data")
class PositionOfFourBytes(Ms2000):
    """READ_MOTOR_POSITION is answered with four bytes."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return super().answer(axis, name) + (b"\0" if name == "a" else b"")


@FAULTS.breaks("no-blanks-in-replies", "status-answered")
class LineFeedAfterStatus(Ms2000):
    """Carriage return and line feed follow the reply to READ_STATUS."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return super().answer(axis, name) + (b"\r\n" if name == "?" else b"")


@FAULTS.breaks("target-no-reply", "no-blanks-in-replies")
class TargetAcknowledged(Ms2000):
    """WRITE_TARGET_POSITION is answered with a colon."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        super().store(axis, name, data)
        self.leaving += b":" if name == "T" else b""


@FAULTS.breaks("ramp-time-no-reply")
class RampTimeAcknowledged(Ms2000):
    """WRITE_RAMPING_TIME is answered with the ramp time."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        super().store(axis, name, data)
        self.leaving += data if name == "Q" else b""


@FAULTS.breaks("errors-ignored", "size-of-data", "sizes-supported")
class AnySizeAccepted(Ms2000):
    """The size of a command that reads is ignored."""

    def fits(self, name: str, size: int | None) -> bool:
        return super().fits(name, size) or (name in "adoqst" and size is not None)


@FAULTS.breaks("colon-found-behind-data", "data-of-command")
class ColonInDataEnds(Ms2000):
    """A colon among the data ends a command."""

    def is_end(self) -> bool:
        return True


@FAULTS.breaks("identification-reply")
class IdentificationWrong(Ms2000):
    """READ_IDENTIFICATION is answered with another name."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return b"EMIT :" if name == "i" else super().answer(axis, name)


@FAULTS.breaks("errors-ignored", "reserved-identifiers", "axis-identifiers")
class UnknownAxisAnswered(Ms2000):
    """A command for an unknown axis is carried out by X."""

    def dispatch(self, command: bytes) -> None:
        known = command[0] in self.axes or command[0] in (26, 27)
        super().dispatch(command if known else b"\x18" + command[1:])


@FAULTS.breaks("foreign-command-silent", "errors-ignored")
class ErrorsReported(Ms2000):
    """An unknown command is answered with an error, as in the high-level format."""

    def dispatch(self, command: bytes) -> None:
        before = len(self.leaving)
        super().dispatch(command)
        if (
            command[1:2]
            and chr(command[1]) not in "adilorqst~?GBATDQRS^JK+-"
            and len(self.leaving) == before
        ):
            self.leaving += b":N-1"


@FAULTS.breaks("no-timeout", "not-recognised-before-colon")
class TimeoutOfASecond(Ms2000):
    """A command is dropped if its colon does not follow within a second."""

    last = -math.inf

    def write(self, data: bytes) -> None:
        if self.clock() - self.last > 1:
            self.buffer.clear()
        self.last = self.clock()
        super().write(data)


@FAULTS.breaks("axis-identifiers", "increment-written", "data-of-command")
class IncrementOfBothAxes(Ms2000):
    """WRITE_INCREMENT_VALUE changes both axes."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        for each in self.axes.values() if name == "D" else (axis,):
            super().store(each, name, data)


@FAULTS.breaks("increment-written", "twos-complement")
class IncrementUnsigned(Ms2000):
    """WRITE_INCREMENT_VALUE loses the sign."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        super().store(axis, name, data)
        axis.increment = abs(axis.increment)


@FAULTS.breaks("ramp-time-written")
class RampTimeNotKept(Ms2000):
    """WRITE_RAMPING_TIME has no effect."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        if name != "Q":
            super().store(axis, name, data)


@FAULTS.breaks("top-speed-written")
class TopSpeedOfOneByte(Ms2000):
    """WRITE_TOP_SPEED uses the first byte only."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        super().store(axis, name, data[:1] + b"\x10" if name == "S" else data)


@FAULTS.breaks("ramp-time-written", "top-speed-written")
class TopSpeedChangesRamp(Ms2000):
    """WRITE_TOP_SPEED also changes the ramp time."""

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        super().store(axis, name, data)
        if name == "S":
            axis.ramp_ms = max(1, axis.top_um_s // 64 % 256)


@FAULTS.breaks("joystick-disabled", "status-joystick-bit")
class JoystickNotDisabled(Ms2000):
    """JOYSTICK_DISABLE has no effect."""

    def set_joystick(self, axis: Axis, on: bool) -> None:
        axis.joystick = True


@FAULTS.breaks("joystick-size-optional", "joystick-disable-size-optional")
class JoystickWithoutASize(Ms2000):
    """JOYSTICK_ENABLE and JOYSTICK_DISABLE are ignored if they have a size."""

    def fits(self, name: str, size: int | None) -> bool:
        return super().fits(name, size) and (name not in "JK" or size is None)


@FAULTS.breaks("status-servo-bit")
class ServoBitMissing(Ms2000):
    """Bit 1 of the status byte is 0."""

    def status_byte(self, axis: Axis) -> int:
        return super().status_byte(axis) & ~0x02


@FAULTS.breaks("ramp-time-reply", "command-identifiers")
class RampTimeNotAnswered(Ms2000):
    """READ_RAMP_TIME is not answered."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return b"" if name == "q" else super().answer(axis, name)


@FAULTS.breaks("target-reply", "no-blanks-in-replies", "command-identifiers")
class TargetAnsweredTwice(Ms2000):
    """READ_TARGET_POSITION is answered twice."""

    def answer(self, axis: Axis, name: str) -> bytes:
        return super().answer(axis, name) * (2 if name == "t" else 1)


@FAULTS.breaks("clears-on-colon", "errors-ignored", "commands-processed-at-colon")
class StuckAfterAnError(Ms2000):
    """After a command with an error, the next command is lost."""

    skip = False

    def dispatch(self, command: bytes) -> None:
        if self.skip:
            self.skip = False
            return
        name = chr(command[1]) if len(command) > 2 else ""
        self.skip = (
            command[0] not in self.axes or not name or name not in "adilorqst~?GBATDQRS^JK+-"
        )
        super().dispatch(command)


@FAULTS.breaks("ignored-before-colon", "colon-found-behind-data")
class BytesBeforeTheColonRefused(Ms2000):
    """A command with further bytes before its colon is ignored."""

    def dispatch(self, command: bytes) -> None:
        if len(command) > 4 and chr(command[1]) in WRITES + "adioqst~":
            size = command[2] if chr(command[1]) in WRITES else 0
            if len(command) > 4 + size:
                return
        super().dispatch(command)


@FAULTS.breaks("high-level-switch", "low-level-only-by-setup")
class AlwaysLowLevel(Ms2000):
    """255 65 does not switch to the high-level format."""

    def setup(self, value: int) -> None:
        super().setup(value)
        self.low_level = self.low_level or value == ord("A")


@FAULTS.breaks("ends-with-colon", "not-recognised-before-colon")
class StatusWithoutAColon(Ms2000):
    """READ_STATUS is carried out before its colon."""

    def receive(self, value: int) -> None:
        super().receive(value)
        if self.low_level and len(self.buffer) == 2 and value == ord("?"):
            self.dispatch(bytes(self.buffer) + bytes((COLON,)))
            self.buffer.clear()

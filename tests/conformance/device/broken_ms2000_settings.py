"""MS-2000 controllers that store settings wrongly or leave the format."""

from __future__ import annotations

from faulty_ms2000_link import FaultyMs2000Link, answers, drops, passes
from ms2000_defects import ACK, STATUSES, Defect, X, Y, bits, changed, named

from stagewire.protocols import CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import messages as m


class SmallLetters(FaultyMs2000Link):
    def other(self, raw: bytes) -> bytes:
        return self.on(b"\xffA" if raw[:2] == b"\xffa" else raw)


class Greets(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(raw) + (b"OK" if frame.axis is None else b"")


class WritesBothAxes(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.on(raw)
        if isinstance(frame.message, m.WriteTopSpeed):
            self.on(bytes((X ^ Y ^ raw[0],)) + raw[1:])
        return said


class PadsShortData(FaultyMs2000Link):
    """Accepts a write of another size, with the data that it has."""

    def other(self, raw: bytes) -> bytes:
        if len(raw) > 4 and raw[1] == m.WriteIncrementValue.layout.id:
            return self.on(raw[:2] + b"\x03" + (raw[3:-1] + bytes(3))[:3] + b":")
        return self.on(raw)


class AnswersShortWrites(FaultyMs2000Link):
    def other(self, raw: bytes) -> bytes:
        return self.on(raw) + (ACK if raw[1:2] == b"Q" else b"")


class NoSizeOfJoystick(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        joystick = isinstance(frame.message, (m.JoystickEnable, m.JoystickDisable))
        return b"" if joystick and not frame.sized else self.on(raw)


class OneJoystick(FaultyMs2000Link):
    """Switches the joystick of both axes."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.on(raw)
        if isinstance(frame.message, m.JoystickDisable):
            self.on(bytes((X ^ Y ^ raw[0],)) + raw[1:])
        return said


SETTINGS = named(
    stays_in_low_level=Defect(
        passes(lambda frame, raw: [] if raw == b"\xffA" else [raw]),
        "formats/high-level",
        "as in that format",
        strategies={"power_on_mode": "low"},
    ),
    small_letters=Defect(SmallLetters, "formats/capital-letter", "lower-case"),
    greets=Defect(Greets, "formats/low-level-again", "SWITCH_TO_LOW_LEVEL was answered"),
    not_written=Defect(
        drops(m.WriteIncrementValue),
        "readback/X/WRITE_INCREMENT_VALUE",
        "then returned 0",
    ),
    acknowledged=Defect(
        answers(lambda raw, _: ACK, m.WriteRampingTime), "readback/Y/WRITE_RAMPING_TIME", "no reply"
    ),
    swapped=Defect(
        passes(changed(m.WriteIncrementValue, lambda data: data[::-1])),
        "readback/X/WRITE_INCREMENT_VALUE",
        "wrote",
    ),
    unsigned=Defect(
        passes(changed(m.WriteIncrementValue, lambda data: data[:2] + bytes((data[2] & 0x7F,)))),
        "readback/Y/WRITE_INCREMENT_VALUE",
        "wrote -",
    ),
    off_by_one=Defect(
        passes(changed(m.WriteRampingTime, lambda data: bytes((data[0] - 1,)))),
        "readback/X/WRITE_RAMPING_TIME",
        "READ_RAMP_TIME then returned",
    ),
    rounded=Defect(
        passes(changed(m.WriteTopSpeed, lambda data: bytes((data[0] & 0xF8,)) + data[1:])),
        "readback/X/WRITE_TOP_SPEED",
        "rounded",
        Result.NON_STRICT,
    ),
    both_axes=Defect(WritesBothAxes, "readback/X/WRITE_TOP_SPEED", "of axis Y from"),
    pads=Defect(
        PadsShortData,
        "written-size/X/WRITE_INCREMENT_VALUE",
        "should be ignored",
        Result.NON_STRICT,
    ),
    answers_short=Defect(AnswersShortWrites, "written-size/X/WRITE_RAMPING_TIME", "was answered"),
    colon_lost=Defect(
        passes(changed(m.WriteIncrementValue, lambda data: data.replace(b":", b"\x00"))),
        "marks-in-data/X/colon-middle",
        "or nothing",
    ),
    joystick_bit=Defect(answers(bits(set_=8), *STATUSES), "joystick/X", "bit 3 should be 0"),
    joystick_size=Defect(NoSizeOfJoystick, "joystick/Y", "without its size"),
    one_joystick=Defect(OneJoystick, "joystick/X", "bit 3 of axis Y changed"),
)

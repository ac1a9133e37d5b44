"""MS-2000 controllers that answer wrongly or report the state of an axis wrongly."""

from __future__ import annotations

from faulty_ms2000_link import FaultyMs2000Link, answers, passes
from ms2000_defects import STATUSES, Defect, Stateful, X, Y, bits, named

from stagewire.protocols import CommandFrame
from stagewire_ms2000 import messages as m


class Wobbles(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, m.ReadRampTime):
            return bytes((answer[0] + self.count % 2,))
        return answer


class Talks(Stateful):
    """Sends something every 0.3 s."""

    def unasked(self) -> bytes:
        beat = int(self.clock() / 0.3)
        said = b"N" if beat != self.memory.get("beat", 0) else b""
        self.memory["beat"] = beat
        return said


class DropsOneInFifty(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        return b"" if self.count % 50 == 0 else answer


class AnswersLate(FaultyMs2000Link):
    """Needs 30 ms for a reply."""

    def read(self, timeout: float) -> bytes:
        if self.waiting:
            self.controller.advance(0.03)
        return super().read(timeout)


READING = named(
    short=Defect(
        answers(lambda raw, _: raw[:-1], m.ReadMotorPosition),
        "reads/X/READ_MOTOR_POSITION",
        "2 bytes",
    ),
    silent=Defect(
        answers(lambda raw, _: b"", m.ReadTargetPosition),
        "reads/Y/READ_TARGET_POSITION",
        "no bytes",
    ),
    carriage_return=Defect(
        answers(lambda raw, _: raw + b"\r"), "reads/X/READ_CURRENT_SPEED", "3 bytes"
    ),
    colon_behind=Defect(
        answers(lambda raw, _: raw + b":", m.ReadStatus), "reads/X/READ_STATUS", "2 bytes"
    ),
    wobbles=Defect(Wobbles, "reads/X/READ_RAMP_TIME", "nothing was set"),
    ramp_of_zero=Defect(
        answers(lambda raw, _: b"\x00", m.ReadRampTime), "reads/X/READ_RAMP_TIME", "from 1 to 255"
    ),
    other_letter=Defect(
        answers(lambda raw, _: b"N", m.ReadStatus), "reads/X/READ_STATUS", "returned 0x4e"
    ),
    other_identity=Defect(
        answers(lambda raw, _: b"EMOX :", m.ReadIdentification), "identification/X", "EMOT"
    ),
    identity_of_five=Defect(
        answers(lambda raw, _: b"EMOT:", m.ReadIdentification), "identification/Y", "5 bytes"
    ),
    identity_ends_otherwise=Defect(
        answers(lambda raw, _: b"EMOT \r", m.ReadIdentification), "identification/X", "0x0d"
    ),
    other_form=Defect(
        passes(lambda frame, raw: [raw, raw] if frame.form != "request" else [raw]),
        "sizes/X/READ_MOTOR_POSITION",
        "6 bytes",
    ),
    talks=Defect(Talks, "quiet", "without a request"),
    drops_one_in_fifty=Defect(DropsOneInFifty, "back-to-back/one-by-one", "of 200"),
    late=Defect(
        AnswersLate, "timing/X/reply", "the PICS promises 20 ms", pics={"reply_p99_ms": 20.0}
    ),
)


class StatusOfAnother(FaultyMs2000Link):
    """READ_STATUS_BYTE of Y returns that of X."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, m.ReadStatusByte) and frame.axis == Y:
            return bytes((self.ask(m.ReadStatusByte(), X)[0] ^ 0x08,))
        return super().command(frame, raw)


STATUS = named(
    no_servo=Defect(answers(bits(clear=2), m.ReadStatusByte), "status/X", "without bit 1"),
    always_moves=Defect(answers(bits(set_=1), *STATUSES), "status/X", "with bit 0"),
    always_ramps=Defect(
        answers(bits(set_=16), m.ReadMotorPositionAndStatus), "status/Y", "with bit 4"
    ),
    both_ends=Defect(answers(bits(set_=192), *STATUSES), "status/X", "both ends"),
    two_statuses=Defect(StatusOfAnother, "status/Y", "should be the same"),
    two_positions=Defect(
        answers(lambda raw, _: b"\x80" + raw[1:], m.ReadMotorPositionAndStatus),
        "status/X",
        "READ_MOTOR_POSITION_AND_STATUS 128",
    ),
    speed_at_rest=Defect(
        answers(lambda raw, _: b"\x07\x00", m.ReadCurrentSpeed), "status/X", "returned 7 µm/s"
    ),
    always_busy=Defect(
        answers(lambda raw, _: b"B", m.ReadStatus), "status/X", "READ_STATUS returned B"
    ),
)

"""A controller that breaks a rule fails the check of this rule, and is named there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from ms2000_spoilt import Make, Spoilt, answers, drops, passes
from ms2000_suite import WIDE, controller_of, declared_with, found, run_suite, state_of

from stagewire.commands import CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import messages as m
from stagewire_ms2000.flags import StatusBits

X, Y = 0x18, 0x19
POSITIONS = (m.ReadMotorPosition, m.ReadMotorPositionAndStatus)
STATUSES = (m.ReadStatusByte, m.ReadMotorPositionAndStatus)
MOVES = (m.WriteTargetPosition, m.IncrementMoveUp, m.IncrementMoveDown, m.WriteVectorSpeed)
ACK = b":A"


@dataclass
class Defect:
    """What is broken, which check has to find it, and a word of what it has to say."""

    make: Make
    check: str
    says: str
    result: Result = Result.FAIL
    pics: Mapping[str, Any] = field(default_factory=dict)
    strategies: Mapping[str, str] = field(default_factory=dict)
    hides: bool = False
    """Whether it does something that nothing tells, so that it cannot be put back."""


def bits(set_: int = 0, clear: int = 0) -> Callable[[bytes, CommandFrame], bytes]:
    """Return what sets and clears bits of a status byte, the last byte of its replies."""
    return lambda raw, frame: raw[:-1] + bytes((raw[-1] & ~clear | set_,))


def named(**defects: Defect) -> dict[str, Defect]:
    return defects


class Stateful(Spoilt):
    """A line with something to remember."""

    def __init__(self, controller: Any) -> None:
        super().__init__(controller)
        self.memory: dict[Any, Any] = {}


# Reading


class Wobbles(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, m.ReadRampTime):
            return bytes((answer[0] + self.count % 2,))
        return answer


class Talks(Stateful):
    """Says something every 0.3 s."""

    def unasked(self) -> bytes:
        beat = int(self.clock() / 0.3)
        said = b"N" if beat != self.memory.get("beat", 0) else b""
        self.memory["beat"] = beat
        return said


class DropsOneInFifty(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        return b"" if self.count % 50 == 0 else answer


class AnswersLate(Spoilt):
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
        answers(lambda raw, _: b"", m.ReadTargetPosition), "reads/Y/READ_TARGET_POSITION", "nothing"
    ),
    carriage_return=Defect(
        answers(lambda raw, _: raw + b"\r"), "reads/X/READ_CURRENT_SPEED", "3 bytes"
    ),
    colon_behind=Defect(
        answers(lambda raw, _: raw + b":", m.ReadStatus), "reads/X/READ_STATUS", "2 bytes"
    ),
    wobbles=Defect(Wobbles, "reads/X/READ_RAMP_TIME", "nothing was set"),
    ramp_of_zero=Defect(
        answers(lambda raw, _: b"\x00", m.ReadRampTime), "reads/X/READ_RAMP_TIME", "within 1 to 255"
    ),
    other_letter=Defect(
        answers(lambda raw, _: b"N", m.ReadStatus), "reads/X/READ_STATUS", "answers 0x4e"
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
    talks=Defect(Talks, "quiet", "nothing was asked"),
    drops_one_in_fifty=Defect(DropsOneInFifty, "back-to-back/one-by-one", "of 200"),
    late=Defect(
        AnswersLate, "timing/X/reply", "the PICS promises 20 ms", pics={"reply_p99_ms": 20.0}
    ),
)


# Status


class StatusOfAnother(Spoilt):
    """READ_STATUS_BYTE of Y tells that of X."""

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
    both_ends=Defect(answers(bits(set_=192), *STATUSES), "status/X", "at both ends"),
    two_statuses=Defect(StatusOfAnother, "status/Y", "it is the same byte"),
    two_positions=Defect(
        answers(lambda raw, _: b"\x80" + raw[1:], m.ReadMotorPositionAndStatus),
        "status/X",
        "READ_MOTOR_POSITION_AND_STATUS 128",
    ),
    speed_at_rest=Defect(
        answers(lambda raw, _: b"\x07\x00", m.ReadCurrentSpeed), "status/X", "tells 7 µm/s"
    ),
    always_busy=Defect(
        answers(lambda raw, _: b"B", m.ReadStatus), "status/X", "READ_STATUS tells B"
    ),
)


# What is wrong with what is sent


class AnswersErrors(Spoilt):
    def other(self, raw: bytes) -> bytes:
        return super().other(raw) + b":N-1\r\n"


class AnswersAnyAxis(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(bytes((X,)) + raw[1:]) if frame.axis else self.on(raw)


class AnswersReserved(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(bytes((X,)) + raw[1:] if frame.axis in (1, 3) else raw)


class AbortedAnswers(Stateful):
    """Carries the last command out again when one is aborted."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        self.memory["last"] = raw
        return self.on(raw)

    def other(self, raw: bytes) -> bytes:
        return self.on(self.memory["last"]) if len(raw) == 2 and "last" in self.memory else b""


class ColonRepeats(AbortedAnswers):
    """Carries the last command out again at every colon."""

    def other(self, raw: bytes) -> bytes:
        return self.on(self.memory["last"]) if raw[:1] == b":" and "last" in self.memory else b""


class SticksAfterGarbage(Stateful):
    """Loses the command behind garbage."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if self.memory.pop("lost", False) else self.on(raw)

    def other(self, raw: bytes) -> bytes:
        self.memory["lost"] = self.loses(raw)
        return b""

    def loses(self, raw: bytes) -> bool:
        return raw[:1] != b":"


class OverflowsForEver(SticksAfterGarbage):
    """Loses the command behind more bytes than its buffer has."""

    def loses(self, raw: bytes) -> bool:
        return len(raw) > 64


class AnyPrefixSwitches(Spoilt):
    """Leaves the format for 255 and whatever follows."""

    def other(self, raw: bytes) -> bytes:
        return self.on(b"\xffA" if raw[0] == 0xFF and len(raw) > 2 else raw)


class AnswersAsManyAsAsked(Spoilt):
    def other(self, raw: bytes) -> bytes:
        own = {cls.layout.id: cls for cls in (m.ReadMotorPosition, m.ReadTargetPosition)}
        if len(raw) == 4 and raw[1] in own:
            return bytes(raw[2])
        return self.on(raw)


class TakesAnySize(Spoilt):
    def other(self, raw: bytes) -> bytes:
        if len(raw) == 4 and raw[1] == m.ReadTargetPosition.layout.id:
            return self.ask(m.ReadTargetPosition(), raw[0])
        return self.on(raw)


class ExampleOfThree(Spoilt):
    """Answers its example, with the size 3, by three bytes."""

    def other(self, raw: bytes) -> bytes:
        if raw[1:3] == b"l\x03":
            return self.ask(m.ReadMotorPosition(), raw[0])
        return self.on(raw)


class AnswersBeforeTheColon(Spoilt):
    def write(self, data: bytes) -> None:
        if len(data) == 3 and data[1] == m.ReadMaximumSpeed.layout.id:
            self.waiting += self.on(data + b":")
        else:
            super().write(data)


class TimesOut(Spoilt):
    """Gives up after two seconds, as the controllers do that this one imitates."""

    last = 0.0

    def write(self, data: bytes) -> None:
        if self.clock() - self.last > 2:
            self.framer.reset()
        self.last = self.clock()
        super().write(data)


class RefusesTheRest(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if frame.extra else self.on(raw)


class CarriesTheRestOut(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(raw) + (self.on(frame.extra + b":") if len(frame.extra) > 2 else b"")


WRONG = named(
    unknown_command=Defect(AnswersErrors, "silence/unknown-command", "was answered"),
    unknown_axis=Defect(AnswersAnyAxis, "silence/unknown-axis", "axis that is none"),
    reserved_axis=Defect(AnswersReserved, "silence/reserved-axis", "reserved"),
    aborted=Defect(AbortedAnswers, "silence/aborted", "right behind an axis"),
    lone_colon=Defect(ColonRepeats, "silence/colons", "colons alone"),
    garbage=Defect(SticksAfterGarbage, "silence/garbage", "after garbage up to a colon"),
    long_garbage=Defect(OverflowsForEver, "silence/long-garbage", "after 300 bytes"),
    any_prefix=Defect(AnyPrefixSwitches, "silence/unknown-setup", "no setup command"),
    as_many_as_asked=Defect(AnswersAsManyAsAsked, "wrong-size/X/READ_MOTOR_POSITION", "bytes"),
    any_size=Defect(
        TakesAnySize, "wrong-size/X/READ_TARGET_POSITION", "it has an error", Result.NON_STRICT
    ),
    example_of_three=Defect(
        ExampleOfThree, "wrong-size/X/READ_MOTOR_POSITION_AND_STATUS", "not by its 4"
    ),
    before_the_colon=Defect(AnswersBeforeTheColon, "colon/missing", "no colon yet"),
    time_out=Defect(TimesOut, "colon/no-time-out", "no time-out"),
    refused_rest=Defect(RefusesTheRest, "colon/ignored-rest", "which are ignored"),
    rest_carried_out=Defect(CarriesTheRestOut, "colon/rest-is-a-command", "which is ignored"),
    behind_garbage=Defect(SticksAfterGarbage, "colon/behind-garbage", "clears the buffers"),
)


# Formats and settings


class SmallLetters(Spoilt):
    def other(self, raw: bytes) -> bytes:
        return self.on(b"\xffA" if raw[:2] == b"\xffa" else raw)


class Greets(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(raw) + (b"OK" if frame.axis is None else b"")


class WritesBothAxes(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.on(raw)
        if isinstance(frame.message, m.WriteTopSpeed):
            self.on(bytes((X ^ Y ^ raw[0],)) + raw[1:])
        return said


class PadsShortData(Spoilt):
    """Takes a write of another size, with as much data as it has."""

    def other(self, raw: bytes) -> bytes:
        if len(raw) > 4 and raw[1] == m.WriteIncrementValue.layout.id:
            return self.on(raw[:2] + b"\x03" + (raw[3:-1] + bytes(3))[:3] + b":")
        return self.on(raw)


class AnswersShortWrites(Spoilt):
    def other(self, raw: bytes) -> bytes:
        return self.on(raw) + (ACK if raw[1:2] == b"Q" else b"")


def changed(
    command: type, change: Callable[[bytes], bytes]
) -> Callable[[CommandFrame, bytes], list[bytes]]:
    """Return what changes the data of a command on its way."""

    def instead(frame: CommandFrame, raw: bytes) -> list[bytes]:
        hit = isinstance(frame.message, command)
        return [raw[:3] + change(raw[3:-1]) + raw[-1:] if hit else raw]

    return instead


class NoSizeOfJoystick(Spoilt):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        joystick = isinstance(frame.message, (m.JoystickEnable, m.JoystickDisable))
        return b"" if joystick and not frame.sized else self.on(raw)


class OneJoystick(Spoilt):
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
        "as in it",
        strategies={"power_on_mode": "low"},
    ),
    small_letters=Defect(SmallLetters, "formats/capital-letter", "no capital"),
    greets=Defect(Greets, "formats/low-level-again", "SWITCH_TO_LOW_LEVEL was answered"),
    not_written=Defect(
        drops(m.WriteIncrementValue),
        "readback/X/WRITE_INCREMENT_VALUE",
        "READ_INCREMENT_VALUE tells 0",
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
        "READ_RAMP_TIME tells",
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
        "is ignored",
        Result.NON_STRICT,
    ),
    answers_short=Defect(AnswersShortWrites, "written-size/X/WRITE_RAMPING_TIME", "was answered"),
    colon_lost=Defect(
        passes(changed(m.WriteIncrementValue, lambda data: data.replace(b":", b"\x00"))),
        "marks-in-data/X/colon-middle",
        "or nothing",
    ),
    joystick_bit=Defect(answers(bits(set_=8), *STATUSES), "joystick/X", "bit 3 has to be 0"),
    joystick_size=Defect(NoSizeOfJoystick, "joystick/Y", "without its size"),
    one_joystick=Defect(OneJoystick, "joystick/X", "bit 3 of axis Y followed"),
)


# Motion


class SaysDoneAtOnce(Stateful):
    """Tells b once, right after a command that moves."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, MOVES):
            self.memory[frame.axis] = True
        if isinstance(frame.message, m.ReadStatus) and self.memory.pop(frame.axis, False):
            return b"b"
        return answer


class SaysDoneTooEarly(Spoilt):
    """Tells b when it begins to slow down."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, m.ReadStatus) and frame.axis:
            status = StatusBits(self.ask(m.ReadStatusByte(), frame.axis)[0])
            return b"b" if status.ramping_down else answer
        return answer


class NeverDone(Stateful):
    """Is busy for ever after a move."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, MOVES):
            self.memory[frame.axis] = True
        return (
            b"B"
            if isinstance(frame.message, m.ReadStatus) and self.memory.get(frame.axis)
            else answer
        )


class StaleBit(Stateful):
    """Tells bit 0 for ever after a move."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, MOVES):
            self.memory[frame.axis] = True
        if isinstance(frame.message, STATUSES) and self.memory.get(frame.axis):
            return bits(set_=1)(answer, frame)
        return answer


def ramps_upside_down(raw: bytes, frame: CommandFrame) -> bytes:
    return raw[:-1] + bytes((raw[-1] ^ 32,)) if raw[-1] & 16 else raw


def switched(raw: bytes, frame: CommandFrame) -> bytes:
    """Exchange bits 6 and 7."""
    bits = raw[-1]
    return raw[:-1] + bytes((bits & 63 | bits << 1 & 128 | bits >> 1 & 64,))


def speeds(change: Callable[[int], int]) -> Callable[[bytes, CommandFrame], bytes]:
    def instead(raw: bytes, frame: CommandFrame) -> bytes:
        speed = int.from_bytes(raw, "little", signed=True)
        return change(speed).to_bytes(2, "little", signed=True)

    return instead


def twice(data: bytes) -> bytes:
    return (int.from_bytes(data, "little") * 2).to_bytes(2, "little")


def other_axis_too(frame: CommandFrame, raw: bytes) -> list[bytes]:
    other = bytes((X ^ Y ^ raw[0],)) + raw[1:]
    return [raw, other] if isinstance(frame.message, m.WriteTargetPosition) else [raw]


def stops_the_other(frame: CommandFrame, raw: bytes) -> list[bytes]:
    stop = m.StopMotor().pack(X ^ Y ^ raw[0])
    return [stop, raw] if isinstance(frame.message, m.WriteTargetPosition) else [raw]


def starts_first(frame: CommandFrame, raw: bytes) -> list[bytes]:
    start = m.StartMotor().pack(X)
    return [start, raw] if isinstance(frame.message, m.WriteTargetPosition) else [raw]


def down_for_up(frame: CommandFrame, raw: bytes) -> list[bytes]:
    swap = {m.IncrementMoveUp: m.IncrementMoveDown, m.IncrementMoveDown: m.IncrementMoveUp}
    other = swap.get(type(frame.message))
    return [other().pack(raw[0]) if other else raw]


class OnlyTells(Stateful):
    """Keeps a number that is written, and tells it, but does not go by it."""

    pair: tuple[type, type]

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        write, read = self.pair
        if isinstance(frame.message, write):
            self.memory[frame.axis] = raw[3:-1]
            return b""
        answer = super().command(frame, raw)
        return self.memory.get(frame.axis, answer) if isinstance(frame.message, read) else answer


class OnlyTellsTopSpeed(OnlyTells):
    pair = m.WriteTopSpeed, m.ReadMaximumSpeed


class OnlyTellsRampTime(OnlyTells):
    pair = m.WriteRampingTime, m.ReadRampTime


class EndsByItself(Stateful):
    """Ends a movement at a speed after 0.15 s."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, m.WriteVectorSpeed):
            self.memory[frame.axis] = self.clock()
        began = self.memory.get(frame.axis)
        if began is not None and self.clock() > began + 0.15:
            del self.memory[frame.axis]
            self.ask(m.WriteVectorSpeed(0), frame.axis or X)
        return super().command(frame, raw)


class MovesForTheCounter(Spoilt):
    """Goes back to where its target is, as a number, when its place gets another one."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        if not isinstance(frame.message, m.WriteMotorPosition):
            return super().command(frame, raw)
        target = self.ask(m.ReadTargetPosition(), raw[0])
        self.on(raw)
        return self.on(raw[:1] + b"T\x03" + target + b":")


MOTION = named(
    does_not_go=Defect(drops(m.WriteTargetPosition), "move-target/X", "a host would take"),
    done_at_once=Defect(SaysDoneAtOnce, "move-target/X", "a host would take the move for done"),
    done_too_early=Defect(SaysDoneTooEarly, "move-target/Y", "its target was"),
    never_done=Defect(NeverDone, "move-target/X", "and is still"),
    elsewhere=Defect(
        passes(changed(m.WriteTargetPosition, lambda data: bytes((data[0] ^ 0x80,)) + data[1:])),
        "move-target/X",
        "READ_TARGET_POSITION tells",
    ),
    answered=Defect(
        answers(lambda raw, _: ACK, m.WriteTargetPosition), "move-target/X", "nobody asked for"
    ),
    no_motor_bit=Defect(answers(bits(clear=1), *STATUSES), "move-target/X", "without bit 0"),
    no_ramps=Defect(answers(bits(clear=16), *STATUSES), "move-target/X", "ramping up"),
    ramps_upside_down=Defect(
        answers(ramps_upside_down, *STATUSES), "move-target/Y", "ramping down"
    ),
    no_sign=Defect(
        answers(speeds(abs), m.ReadCurrentSpeed),
        "move-target/X",
        "the sign of its way",
    ),
    too_fast=Defect(
        answers(speeds(lambda speed: speed * 5 // 4), m.ReadCurrentSpeed),
        "move-target/X",
        "its maximum is 6000",
    ),
    stale_bit=Defect(StaleBit, "move-target/X", "with bit 0: it moves"),
    other_axis=Defect(passes(other_axis_too), "move-target/X", "axis Y went from 0"),
    not_turned_round=Defect(
        answers(lambda raw, _: raw[:2] + bytes((raw[2] | 0x80,)), m.ReadTargetPosition),
        "move-target/X/turned-round",
        "outside",
    ),
    down_for_up=Defect(passes(down_for_up), "move-increment/X", "made the target"),
    increment_answered=Defect(
        answers(lambda raw, _: ACK, m.IncrementMoveDown), "move-increment/Y", "nobody asked for"
    ),
    stops_the_other=Defect(
        passes(stops_the_other), "move-together/X/Y", "axis Y is not busy", hides=True
    ),
    does_not_stop=Defect(drops(m.StopMotor), "stop-start/X", "went on to its target"),
    stop_answered=Defect(answers(lambda raw, _: ACK, m.StopMotor), "stop-start/Y", "no reply"),
    goes_when_disabled=Defect(passes(starts_first), "stop-start/X", "which disables it"),
    does_not_start=Defect(drops(m.StartMotor), "stop-start/X", "a host would take"),
    busy_when_disabled=Defect(
        Spoilt,
        "stop-start/X",
        "from firmware 3.3 on it tells b",
        pics={"firmware": "3.3"},
        strategies={"disabled_axis": "busy"},
    ),
    only_tells_top_speed=Defect(OnlyTellsTopSpeed, "top-speed/X", "whose top speed was set to"),
    no_vector=Defect(drops(m.WriteVectorSpeed), "move-vector/X", "a host would take"),
    twice_the_speed=Defect(
        passes(changed(m.WriteVectorSpeed, twice)),
        "move-vector/X",
        "goes at",
    ),
    ends_by_itself=Defect(EndsByItself, "move-vector/Y", "until told otherwise"),
    vector_answered=Defect(
        answers(lambda raw, _: ACK, m.WriteVectorSpeed), "move-vector/X", "nobody asked for"
    ),
    only_tells_ramp_time=Defect(OnlyTellsRampTime, "ramps/X/target", "with a ramp of 250 ms"),
    ramp_of_vector=Defect(OnlyTellsRampTime, "ramps/Y/vector", "with a ramp of 250 ms"),
    no_switch=Defect(
        answers(bits(clear=64), *STATUSES),
        "limits/X/upper",
        "without the bit of the upper switch",
        pics={"travel": "-5..5mm"},
    ),
    switches_of_the_example=Defect(
        answers(switched, *STATUSES),
        "limits/Y/lower",
        "against the table",
        Result.NON_STRICT,
        pics={"travel": "-5..5mm"},
    ),
    counter_moves=Defect(MovesForTheCounter, "counter/X", "after WRITE_MOTOR_POSITION"),
    sixteen_bits=Defect(
        answers(
            lambda raw, _: raw[:2] + (b"\xff" if raw[1] & 0x80 else b"\x00"), m.ReadMotorPosition
        ),
        "counter/X",
        "READ_MOTOR_POSITION tells",
    ),
    no_counter=Defect(
        drops(m.WriteMotorPosition), "counter/Y", "of axis Y READ_MOTOR_POSITION tells 0"
    ),
)

ALL = {
    f"{group}-{name}": defect
    for group, defects in (
        ("reading", READING),
        ("status", STATUS),
        ("wrong", WRONG),
        ("settings", SETTINGS),
        ("motion", MOTION),
    )
    for name, defect in defects.items()
}


@pytest.mark.parametrize("defect", ALL.values(), ids=ALL)
def test_a_defect_is_found_by_its_check(defect: Defect) -> None:
    controller = controller_of(strategies=defect.strategies, travel=100_000, position=50_000)
    before = state_of(controller)
    report = run_suite(defect.make(controller), declared_with(**defect.pics), WIDE, [defect.check])
    [(check, result, text)] = found(report, *Result)
    assert (check, result) == (defect.check, defect.result), text
    assert defect.says in text
    controller.advance(5)
    assert state_of(controller) == before or "not restored" in text or defect.hides

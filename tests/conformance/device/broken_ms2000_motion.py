"""MS-2000 controllers that move wrongly or report motion wrongly."""

from __future__ import annotations

from collections.abc import Callable

from faulty_ms2000_link import FaultyMs2000Link, answers, drops, passes
from ms2000_defects import ACK, MOVES, STATUSES, Defect, Stateful, X, Y, bits, changed, named

from stagewire.protocols import CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import messages as m
from stagewire_ms2000.flags import StatusBits


class SaysDoneAtOnce(Stateful):
    """Reports b once, immediately after a command that moves."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        answer = super().command(frame, raw)
        if isinstance(frame.message, MOVES):
            self.memory[frame.axis] = True
        if isinstance(frame.message, m.ReadStatus) and self.memory.pop(frame.axis, False):
            return b"b"
        return answer


class SaysDoneTooEarly(FaultyMs2000Link):
    """Reports b when it begins to slow down."""

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
    """Reports bit 0 for ever after a move."""

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
    return (int.from_bytes(data, "little") * 2 % 0x10000).to_bytes(2, "little")


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
    """Stores and reports a written number, but does not use it."""

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
    """Ends a movement at constant speed after 0.15 s."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, m.WriteVectorSpeed):
            self.memory[frame.axis] = self.clock()
        began = self.memory.get(frame.axis)
        if began is not None and self.clock() > began + 0.15:
            del self.memory[frame.axis]
            self.ask(m.WriteVectorSpeed(0), frame.axis or X)
        return super().command(frame, raw)


class MovesForTheCounter(FaultyMs2000Link):
    """Returns to its target as a number when its counter is set."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        if not isinstance(frame.message, m.WriteMotorPosition):
            return super().command(frame, raw)
        target = self.ask(m.ReadTargetPosition(), raw[0])
        self.on(raw)
        return self.on(raw[:1] + b"T\x03" + target + b":")


MOTION = named(
    does_not_go=Defect(drops(m.WriteTargetPosition), "move-target/X", "a host would assume"),
    done_at_once=Defect(SaysDoneAtOnce, "move-target/X", "a host would assume"),
    done_too_early=Defect(SaysDoneTooEarly, "move-target/Y", "but the axis moved on"),
    never_done=Defect(NeverDone, "move-target/X", "was still busy"),
    elsewhere=Defect(
        passes(changed(m.WriteTargetPosition, lambda data: bytes((data[0] ^ 0x80,)) + data[1:])),
        "move-target/X",
        "READ_TARGET_POSITION returned",
    ),
    answered=Defect(
        answers(lambda raw, _: ACK, m.WriteTargetPosition), "move-target/X", "should get no reply"
    ),
    no_motor_bit=Defect(answers(bits(clear=1), *STATUSES), "move-target/X", "without bit 0"),
    no_ramps=Defect(answers(bits(clear=16), *STATUSES), "move-target/X", "ramping up"),
    ramps_upside_down=Defect(
        answers(ramps_upside_down, *STATUSES), "move-target/Y", "ramping down"
    ),
    no_sign=Defect(
        answers(speeds(abs), m.ReadCurrentSpeed),
        "move-target/X",
        "the sign of the speed",
    ),
    too_fast=Defect(
        answers(speeds(lambda speed: speed * 5 // 4), m.ReadCurrentSpeed),
        "move-target/X",
        "its maximum is 6000",
    ),
    stale_bit=Defect(StaleBit, "move-target/X", "with bit 0, which means motion"),
    other_axis=Defect(passes(other_axis_too), "move-target/X", "axis Y also moved, from 0"),
    not_turned_round=Defect(
        answers(lambda raw, _: raw[:2] + bytes((raw[2] | 0x80,)), m.ReadTargetPosition),
        "move-target/X/turned-round",
        "outside",
    ),
    down_for_up=Defect(passes(down_for_up), "move-increment/X", "set the target"),
    increment_answered=Defect(
        answers(lambda raw, _: ACK, m.IncrementMoveDown), "move-increment/Y", "should get no reply"
    ),
    stops_the_other=Defect(
        passes(stops_the_other), "move-together/X/Y", "but it does not begin", hides=True
    ),
    does_not_stop=Defect(drops(m.StopMotor), "stop-start/X", "but went on to its target"),
    stop_answered=Defect(answers(lambda raw, _: ACK, m.StopMotor), "stop-start/Y", "no reply"),
    goes_when_disabled=Defect(passes(starts_first), "stop-start/X", "which disables it"),
    does_not_start=Defect(drops(m.StartMotor), "stop-start/X", "a host would assume"),
    busy_when_disabled=Defect(
        FaultyMs2000Link,
        "stop-start/X",
        "since firmware 3.3 it should return b",
        pics={"firmware": "3.3"},
        strategies={"disabled_axis": "busy"},
    ),
    only_tells_top_speed=Defect(OnlyTellsTopSpeed, "top-speed/X", "with a top speed of"),
    no_vector=Defect(drops(m.WriteVectorSpeed), "move-vector/X", "a host would assume"),
    twice_the_speed=Defect(
        passes(changed(m.WriteVectorSpeed, twice)),
        "move-vector/X",
        "moves at",
    ),
    ends_by_itself=Defect(EndsByItself, "move-vector/Y", "until the next command"),
    vector_answered=Defect(
        answers(lambda raw, _: ACK, m.WriteVectorSpeed), "move-vector/X", "should get no reply"
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
        "unlike the table",
        Result.NON_STRICT,
        pics={"travel": "-5..5mm"},
    ),
    counter_moves=Defect(MovesForTheCounter, "counter/X", "after WRITE_MOTOR_POSITION"),
    sixteen_bits=Defect(
        answers(
            lambda raw, _: raw[:2] + (b"\xff" if raw[1] & 0x80 else b"\x00"), m.ReadMotorPosition
        ),
        "counter/X",
        "READ_MOTOR_POSITION of axis X returned",
    ),
    no_counter=Defect(
        drops(m.WriteMotorPosition), "counter/Y", "READ_MOTOR_POSITION of axis Y returned 0"
    ),
)

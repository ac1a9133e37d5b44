"""MS-2000 controllers that do not ignore errors, or that ignore valid commands."""

from __future__ import annotations

from faulty_ms2000_link import FaultyMs2000Link
from ms2000_defects import Defect, Stateful, X, named

from stagewire.protocols import CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import messages as m


class AnswersErrors(FaultyMs2000Link):
    def other(self, raw: bytes) -> bytes:
        return super().other(raw) + b":N-1\r\n"


class AnswersAnyAxis(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(bytes((X,)) + raw[1:]) if frame.axis else self.on(raw)


class AnswersReserved(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(bytes((X,)) + raw[1:] if frame.axis in (1, 3) else raw)


class AbortedAnswers(Stateful):
    """Repeats the last command when a command is aborted."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        self.memory["last"] = raw
        return self.on(raw)

    def other(self, raw: bytes) -> bytes:
        return self.on(self.memory["last"]) if len(raw) == 2 and "last" in self.memory else b""


class ColonRepeats(AbortedAnswers):
    """Repeats the last command at every colon."""

    def other(self, raw: bytes) -> bytes:
        return self.on(self.memory["last"]) if raw[:1] == b":" and "last" in self.memory else b""


class SticksAfterGarbage(Stateful):
    """Loses the command after garbage."""

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if self.memory.pop("lost", False) else self.on(raw)

    def other(self, raw: bytes) -> bytes:
        self.memory["lost"] = self.loses(raw)
        return b""

    def loses(self, raw: bytes) -> bool:
        return raw[:1] != b":"


class OverflowsForEver(SticksAfterGarbage):
    """Loses the command after more bytes than fit into its buffer."""

    def loses(self, raw: bytes) -> bool:
        return len(raw) > 64


class AnyPrefixSwitches(FaultyMs2000Link):
    """Leaves the format at 255 followed by any byte."""

    def other(self, raw: bytes) -> bytes:
        return self.on(b"\xffA" if raw[0] == 0xFF and len(raw) > 2 else raw)


class AnswersAsManyAsAsked(FaultyMs2000Link):
    def other(self, raw: bytes) -> bytes:
        own = {cls.layout.id: cls for cls in (m.ReadMotorPosition, m.ReadTargetPosition)}
        if len(raw) == 4 and raw[1] in own:
            return bytes(raw[2])
        return self.on(raw)


class TakesAnySize(FaultyMs2000Link):
    def other(self, raw: bytes) -> bytes:
        if len(raw) == 4 and raw[1] == m.ReadTargetPosition.layout.id:
            return self.ask(m.ReadTargetPosition(), raw[0])
        return self.on(raw)


class ExampleOfThree(FaultyMs2000Link):
    """Answers the size 3 of the documented example with three bytes."""

    def other(self, raw: bytes) -> bytes:
        if raw[1:3] == b"l\x03":
            return self.ask(m.ReadMotorPosition(), raw[0])
        return self.on(raw)


class AnswersBeforeTheColon(FaultyMs2000Link):
    def write(self, data: bytes) -> None:
        if len(data) == 3 and data[1] == m.ReadMaximumSpeed.layout.id:
            self.waiting += self.on(data + b":")
        else:
            super().write(data)


class TimesOut(FaultyMs2000Link):
    """Gives up after two seconds, like the controllers that this one imitates."""

    last = 0.0

    def write(self, data: bytes) -> None:
        if self.clock() - self.last > 2:
            self.framer.reset()
        self.last = self.clock()
        super().write(data)


class RefusesTheRest(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if frame.extra else self.on(raw)


class CarriesTheRestOut(FaultyMs2000Link):
    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        return self.on(raw) + (self.on(frame.extra + b":") if len(frame.extra) > 2 else b"")


WRONG = named(
    unknown_command=Defect(AnswersErrors, "silence/unknown-command", "was answered"),
    unknown_axis=Defect(AnswersAnyAxis, "silence/unknown-axis", "unknown axis"),
    reserved_axis=Defect(AnswersReserved, "silence/reserved-axis", "reserved"),
    aborted=Defect(AbortedAnswers, "silence/aborted", "immediately after an axis"),
    lone_colon=Defect(ColonRepeats, "silence/colons", "colons alone"),
    garbage=Defect(SticksAfterGarbage, "silence/garbage", "after stray bytes and a colon"),
    long_garbage=Defect(OverflowsForEver, "silence/long-garbage", "after 300 bytes"),
    any_prefix=Defect(AnyPrefixSwitches, "silence/unknown-setup", "unknown setup byte"),
    as_many_as_asked=Defect(AnswersAsManyAsAsked, "wrong-size/X/READ_MOTOR_POSITION", "bytes"),
    any_size=Defect(
        TakesAnySize,
        "wrong-size/X/READ_TARGET_POSITION",
        "a command with an error",
        Result.NON_STRICT,
    ),
    example_of_three=Defect(
        ExampleOfThree, "wrong-size/X/READ_MOTOR_POSITION_AND_STATUS", "the reply should have 4"
    ),
    before_the_colon=Defect(AnswersBeforeTheColon, "colon/missing", "without its colon"),
    time_out=Defect(TimesOut, "colon/no-time-out", "no time-out"),
    refused_rest=Defect(RefusesTheRest, "colon/ignored-rest", "before the colon"),
    rest_carried_out=Defect(
        CarriesTheRestOut, "colon/rest-is-a-command", "a second command before the colon"
    ),
    behind_garbage=Defect(SticksAfterGarbage, "colon/behind-garbage", "should clear the buffers"),
)

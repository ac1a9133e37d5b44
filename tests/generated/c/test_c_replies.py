"""The C reader of replies compared with the Python decoder: complete, late and unsolicited replies."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from command_library import CommandLibrary
from command_readers import Event, Replies
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from stagewire.errors import CodecError, OutstandingReplyError
from stagewire.framing import Event as PythonEvent
from stagewire.framing import ReplyDecoder, ReplyReceived
from stagewire.protocols import Command, CommandFrame, SetupCommand

some_bytes = st.binary(max_size=9)


def frames(library: CommandLibrary) -> list[CommandFrame]:
    """Return a frame of every command and setup command in each of its forms."""
    axis = next(iter(library.protocol.axes.values()))
    found = []
    for cls in library.protocol.messages:
        if issubclass(cls, SetupCommand):
            found.append(CommandFrame(cls()))
        elif issubclass(cls, Command):
            message = cls.unpack(bytes(3 + cls.layout.length + 1))
            found.append(CommandFrame(message, axis))
            if not cls.layout.length:
                found += [CommandFrame(message, axis, sized=sized) for sized in (True, False)]
    return found


def shown(events: list[PythonEvent]) -> list[Event]:
    return [
        Event("message" if isinstance(event, ReplyReceived) else "garbage", event.raw)
        for event in events
    ]


def sent(decoder: ReplyDecoder, frame: CommandFrame) -> str:
    """Return the status for a command in Python, as the name in C."""
    waiting = decoder.outstanding
    try:
        decoder.sent(frame)
    except OutstandingReplyError:
        return "OUTSTANDING" if waiting else "POISONED"
    return "OK"


def test_the_reader_behaves_like_the_decoder_of_python(library: CommandLibrary) -> None:
    """Commands, replies and timeouts in random order."""

    class Line(RuleBasedStateMachine):
        known: ClassVar[list[CommandFrame]] = frames(library)

        def __init__(self) -> None:
            super().__init__()
            self.python = library.protocol.replies()
            self.c = library.replies()

        @rule(frame=st.sampled_from(known))
        def send(self, frame: CommandFrame) -> None:
            raw = frame.encode(allow_dummy=True)
            assert self.c.sent(raw) == sent(self.python, frame)

        @rule(data=some_bytes)
        def come(self, data: bytes) -> None:
            assert self.c.feed(data) == shown(self.python.feed(data))

        @rule(more=st.sampled_from((-1, 0, 0, 0, 1)), byte=st.integers(0, 0xFF))
        def answer(self, more: int, byte: int) -> None:
            """Feed the expected bytes, or one more or less."""
            if self.python.outstanding is not None:
                reply: Any = self.python.outstanding.message.reply
                due = reply.layout.length - len(self.python.pending)
                self.come(bytes((byte,)) * (due + more))

        @rule()
        def give_up(self) -> None:
            assert self.c.abandon() == shown(self.python.abandon())

        @rule()
        def wait(self) -> None:
            self.c.drained()
            self.python.drained()

        @invariant()
        def same_state(self) -> None:
            assert self.c.pending == self.python.pending
            assert self.c.asks("outstanding") == (self.python.outstanding is not None)
            assert self.c.asks("poisoned") == self.python.poisoned

    class Test(Line.TestCase):  # type: ignore[name-defined, misc]
        settings = settings(max_examples=100, stateful_step_count=30, deadline=None)

    Test("runTest").runTest()


def test_every_reply_can_arrive_in_pieces(library: CommandLibrary) -> None:
    for frame in frames(library):
        reply: Any = frame.message.reply
        if reply is not None:
            answer = bytes(range(1, reply.layout.length + 1))
            for cut in range(len(answer) + 1):
                reader = asked(library, frame)
                events = reader.feed(answer[:cut]) + reader.feed(answer[cut:])
                assert events == [Event("message", answer)]
                assert not reader.asks("outstanding")
                assert not reader.asks("poisoned")


def asked(library: CommandLibrary, frame: CommandFrame) -> Replies:
    reader = library.replies()
    assert reader.sent(frame.encode(allow_dummy=True)) == "OK"
    return reader


def first_request(library: CommandLibrary) -> tuple[CommandFrame, int]:
    for frame in frames(library):
        reply = frame.message.reply
        if reply is not None:
            return frame, reply.layout.length
    raise AssertionError("no command has a reply")


def test_no_request_is_sent_before_bytes_after_a_reply_are_read(
    library: CommandLibrary,
) -> None:
    """The rest of a chunk would be taken for the next reply."""
    frame, length = first_request(library)
    reader = asked(library, frame)
    event, rest = reader.next(bytes(length) + b"\1")
    assert (event, rest) == (Event("message", bytes(length)), b"\1")
    assert reader.sent(frame.encode(allow_dummy=True)) == "POISONED"
    assert reader.next(rest) == (Event("garbage", b"\1"), b"")


def test_invalid_commands_are_not_registered(library: CommandLibrary) -> None:
    frame, _ = first_request(library)
    raw = frame.encode(allow_dummy=True)
    reader = library.replies()
    for wrong in (b"", raw[:2], raw + raw, b"\1" + bytes((library.protocol.marks.terminator,))):
        with pytest.raises(CodecError):
            library.protocol.decode(wrong)
        assert reader.sent(wrong) in ("TOO_SHORT", "TRAILING", "WRONG_LENGTH")
        assert not reader.asks("outstanding")
    assert reader.sent(raw) == "OK"


def test_an_outstanding_request_is_reported_before_a_poisoned_line(library: CommandLibrary) -> None:
    frame, length = first_request(library)
    raw = frame.encode(allow_dummy=True)
    reader = library.replies()
    assert reader.feed(b"\1") == [Event("garbage", b"\1")]
    assert reader.sent(raw) == "POISONED"
    reader.drained()
    assert reader.sent(raw) == "OK"
    assert reader.sent(raw) == "OUTSTANDING"
    assert reader.feed(bytes(length)) == [Event("message", bytes(length))]
    assert reader.sent(raw) == "OK"

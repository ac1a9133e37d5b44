"""Replies, identified by the outstanding request: complete, late and unexpected ones."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from invented_commands import (
    PROTOCOL,
    ReadCount,
    ReadCountReply,
    ReadName,
    ReadNameReply,
    ReadState,
    Restart,
    Stop,
)

from stagewire.errors import BadValueError, OutstandingReplyError, StagewireError
from stagewire.framing import Event, Garbage, ReplyDecoder, ReplyReceived, join_garbage
from stagewire.protocols import CommandFrame

COUNT = CommandFrame(ReadCount(), 0x21)
STATE = CommandFrame(ReadState(), 0x21)
NAME = CommandFrame(ReadName(), 0x22)
ANSWER = b"\xa0\x86\x01"


def asked(frame: CommandFrame = COUNT) -> ReplyDecoder:
    decoder = PROTOCOL.replies()
    decoder.sent(frame)
    return decoder


def test_the_request_determines_the_reply() -> None:
    decoder = asked()
    assert decoder.outstanding is COUNT
    (event,) = decoder.feed(ANSWER)
    assert event == ReplyReceived(ANSWER, COUNT)
    assert isinstance(event, ReplyReceived)
    assert event.request is COUNT
    assert event.reply == ReadCountReply(100_000)
    assert decoder.outstanding is None
    decoder.sent(NAME)
    (event,) = decoder.feed(b"EMOT \r")
    assert isinstance(event, ReplyReceived)
    assert event.reply == ReadNameReply("EMOT \r")


def test_a_reply_may_arrive_in_pieces() -> None:
    decoder = asked()
    assert decoder.feed(ANSWER[:1]) == []
    assert decoder.feed(b"") == []
    assert decoder.pending == ANSWER[:1]
    assert decoder.feed(ANSWER[1:]) == [ReplyReceived(ANSWER, COUNT)]
    assert decoder.pending == b""


def test_unexpected_bytes_are_garbage_and_poison_the_line() -> None:
    decoder = PROTOCOL.replies()
    assert decoder.feed(b"") == []
    assert not decoder.poisoned
    assert decoder.feed(b"ab") == [Garbage(b"ab")]
    assert decoder.poisoned
    with pytest.raises(OutstandingReplyError, match="unexpected bytes arrived"):
        decoder.sent(COUNT)
    decoder.drained()
    decoder.sent(COUNT)
    assert decoder.feed(ANSWER + b"more") == [ReplyReceived(ANSWER, COUNT), Garbage(b"more")]
    assert decoder.poisoned


def test_a_duplicated_reply_answers_one_request_in_any_chunks() -> None:
    for cut in range(2 * len(ANSWER) + 1):
        decoder = asked()
        twice = ANSWER + ANSWER
        decoder.feed(twice[:cut])
        decoder.feed(twice[cut:])
        with pytest.raises(OutstandingReplyError):
            decoder.sent(COUNT)


def test_a_command_without_a_reply_leaves_nothing_outstanding() -> None:
    decoder = PROTOCOL.replies()
    for frame in (CommandFrame(Stop(), 0x21), CommandFrame(Restart())):
        decoder.sent(frame)
        assert decoder.outstanding is None
    assert decoder.feed(b"a") == [Garbage(b"a")]


def test_a_motor_can_be_stopped_while_a_reply_is_outstanding() -> None:
    decoder = asked()
    decoder.sent(CommandFrame(Stop(), 0x21))
    assert decoder.feed(ANSWER) == [ReplyReceived(ANSWER, COUNT)]


def test_at_most_one_request_is_outstanding() -> None:
    decoder = asked()
    decoder.feed(ANSWER[:2])
    for again in (COUNT, STATE):
        with pytest.raises(OutstandingReplyError, match="the reply to READ_COUNT is outstanding"):
            decoder.sent(again)
    assert decoder.outstanding is COUNT
    assert decoder.feed(ANSWER[2:]) == [ReplyReceived(ANSWER, COUNT)]
    decoder.sent(STATE)
    assert issubclass(OutstandingReplyError, StagewireError)


def test_a_late_reply_never_answers_another_request() -> None:
    decoder = asked()
    assert decoder.abandon() == []
    assert decoder.poisoned
    assert decoder.outstanding is None
    with pytest.raises(OutstandingReplyError, match=r"READ_STATE has to wait: .* drained\(\)"):
        decoder.sent(STATE)
    assert decoder.feed(ANSWER) == [Garbage(ANSWER)]
    with pytest.raises(OutstandingReplyError):
        decoder.sent(STATE)
    decoder.drained()
    decoder.sent(STATE)
    assert decoder.feed(b"B") == [ReplyReceived(b"B", STATE)]


def test_the_bytes_of_an_abandoned_reply_are_garbage() -> None:
    decoder = asked()
    decoder.feed(ANSWER[:2])
    assert decoder.abandon() == [Garbage(ANSWER[:2])]
    assert decoder.pending == b""
    assert decoder.feed(ANSWER[2:]) == [Garbage(ANSWER[2:])]
    assert decoder.poisoned


def test_commands_without_a_reply_are_sent_on_a_poisoned_line() -> None:
    decoder = asked()
    decoder.abandon()
    decoder.sent(CommandFrame(Stop(), 0x21))
    assert decoder.poisoned


def test_abandoning_without_a_request_has_no_effect() -> None:
    decoder = PROTOCOL.replies()
    assert decoder.abandon() == []
    assert not decoder.poisoned
    decoder.drained()
    decoder.sent(COUNT)


@pytest.mark.parametrize("wrong", [ReadCount(), "READ_COUNT", None, b"\x21\x3f\x0d"])
def test_only_frames_can_be_sent(wrong: object) -> None:
    with pytest.raises(BadValueError, match="sent takes a CommandFrame, not"):
        PROTOCOL.replies().sent(wrong)  # type: ignore[arg-type]


def test_feeding_text_raises() -> None:
    with pytest.raises(TypeError, match="a framer takes bytes, not str"):
        asked().feed("ab")  # type: ignore[arg-type]


def test_all_types_of_bytes_are_accepted_and_copied() -> None:
    for data in (bytearray(ANSWER), memoryview(ANSWER)):
        (event,) = asked().feed(data)
        assert event == ReplyReceived(ANSWER, COUNT)
        assert type(event.raw) is bytes


def test_events_with_different_requests_differ() -> None:
    event = ReplyReceived(b"B", STATE)
    assert event != ReplyReceived(b"B", CommandFrame(ReadState(), 0x22))
    assert event != Garbage(b"B")
    assert Garbage(b"B") != event
    assert len({event, ReplyReceived(b"B", STATE)}) == 1
    assert repr(event) == "ReplyReceived('42', CommandFrame(ReadState(), axis=0x21))"


STEPS = st.lists(
    st.one_of(
        st.sampled_from([COUNT, STATE, NAME]), st.binary(max_size=8), st.sampled_from(["abandon", "drained"])
    ),
    max_size=40,
)  # fmt: skip


@given(STEPS)
def test_no_byte_is_lost_and_no_reply_is_shifted(steps: list[CommandFrame | bytes | str]) -> None:
    decoder = PROTOCOL.replies()
    fed = out = b""
    since = 0  # position in the stream at which the outstanding request was sent
    for step in steps:
        events: list[Event] = []
        if isinstance(step, CommandFrame):
            free = decoder.outstanding is None and not decoder.poisoned
            try:
                decoder.sent(step)
            except OutstandingReplyError:
                assert not free
            else:
                assert free
                since = len(fed)
        elif isinstance(step, bytes):
            fed += step
            events = decoder.feed(step)
        elif step == "abandon":
            events = decoder.abandon()
        else:
            decoder.drained()
        for event in events:
            if isinstance(event, ReplyReceived):
                assert len(out) == since
                reply = event.request.message.reply  # type: ignore[union-attr]
                assert len(event.raw) == reply.layout.length
            out += event.raw
        assert out + decoder.pending == fed
        assert len(decoder.pending) < 6


@given(st.binary(min_size=6, max_size=20), st.sets(st.integers(1, 19)))
def test_chunking_does_not_matter(data: bytes, cuts: set[int]) -> None:
    whole = join_garbage(asked(NAME).feed(data))
    decoder = asked(NAME)
    places = sorted({0, len(data), *(cut for cut in cuts if cut < len(data))})
    events = [event for i, j in pairwise(places) for event in decoder.feed(data[i:j])]
    assert join_garbage(events) == whole

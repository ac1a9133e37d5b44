"""Frames as values: repr, pattern matching and equality."""

from __future__ import annotations

import pytest

from stagewire import End, Frame
from stagewire.framing import Received
from stagewire.protocols import Direction, FramedProtocol, Layout, UndecidedMessage
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from undocumented import PROTOCOL as WITH_UNPRINTED
from undocumented import HwUnprinted

MOVE = m.MotMoveAbsolute(1, 5)
FRAME = Frame(MOVE, 0x50, 0x01, b"ab")


def test_a_pattern_matches_the_parts_by_position() -> None:
    match FRAME:
        case Frame(message, dest, source, extra):
            assert (message, dest, source, extra) == (MOVE, 0x50, 0x01, b"ab")
        case _:
            pytest.fail("no match")


def test_repr_of_a_frame() -> None:
    shown = "Frame(MotMoveAbsolute(chan_ident=1, absolute_distance=5), dest=0x50, source=0x01"
    assert repr(FRAME) == f"{shown}, extra=b'ab')"
    assert repr(Frame(MOVE, 0x50, 0x01)) == f"{shown})"


@pytest.mark.parametrize(
    "other",
    [
        Frame(m.MotMoveAbsolute(1, 6), 0x50, 0x01, b"ab"),
        Frame(MOVE, 0x51, 0x01, b"ab"),
        Frame(MOVE, 0x50, 0x02, b"ab"),
        Frame(MOVE, 0x50, 0x01, b"ac"),
        Frame(MOVE, 0x50, 0x01),
        MOVE,
    ],
)
def test_frames_that_differ_in_one_part_are_unequal(other: object) -> None:
    assert other != FRAME
    assert hash(other) != hash(FRAME)


def test_a_frame_cannot_be_changed() -> None:
    with pytest.raises(AttributeError, match="Frame is immutable; make a new one to change dest"):
        FRAME.dest = 1
    with pytest.raises(AttributeError, match="Frame is immutable; source cannot be deleted"):
        del FRAME.source
    with pytest.raises(
        AttributeError, match="MotMoveAbsolute is immutable; make a new one to change"
    ):
        MOVE.chan_ident = 2
    with pytest.raises(AttributeError, match="MotMoveAbsolute is immutable; chan_ident cannot be"):
        del MOVE.chan_ident


def test_the_length_counts_extra_bytes() -> None:
    assert FRAME.encode() == bytes.fromhex("5304 0800 d001 0100 05000000") + b"ab"
    longest = Frame(MOVE, 0x50, 0x01, bytes(249)).encode()
    assert longest[2:4] == b"\xff\0"
    assert m.decode(longest).extra == bytes(249)


def test_ends_by_name() -> None:
    assert [End(name) for name in ("host", "device", "none")] == [End.HOST, End.DEVICE, End.NONE]


def test_an_undocumented_message_keeps_the_received_bytes() -> None:
    header = bytes.fromhex("f100 0102 0150")
    assert WITH_UNPRINTED.decode(header).message == HwUnprinted(param1=1, param2=2)
    data = bytes.fromhex("f100 0200 8150 abcd")
    assert WITH_UNPRINTED.decode(data).message == HwUnprinted(b"\xab\xcd")
    for raw in (header, data):
        assert WITH_UNPRINTED.decode(raw).encode() == raw
        assert WITH_UNPRINTED.decode(raw).extra == b""
    for low, high in ((0, 255), (255, 0)):
        assert HwUnprinted(param1=low, param2=high).pack(1, 0x50)[2:4] == bytes((low, high))
    assert HwUnprinted(bytes(255)).pack(0x7F, 0xFF)[2:6] == b"\xff\0\xff\xff"
    assert HwUnprinted(memoryview(b"ab")) == HwUnprinted(b"ab")  # type: ignore[arg-type]


class Nothing(UndecidedMessage):
    """An undecided packet whose layouts have no common field."""

    __slots__ = ()
    layout = Layout("NOTHING", 0x0777, Direction.TO_HOST, "data:undecided", ("data",), 4)
    shared = ()


def test_an_undecided_message_without_shared_fields() -> None:
    protocol = FramedProtocol("one", "One", "one", [Nothing], 1, frozenset({0x50}), {})
    made = protocol.build("NOTHING", {}, "data:undecided", b"abcd")
    assert made == Nothing(b"abcd")
    assert made.pack(1, 0x50) == bytes.fromhex("7707 0400 8150") + b"abcd"
    assert repr(protocol) == "<Protocol one: 1 messages>"
    assert repr(Nothing.layout) == "<Layout NOTHING data:undecided>"


@pytest.mark.parametrize("before", ["", "ff"])
def test_a_framer_s_events_are_decoded_in_step_and_after_garbage(before: str) -> None:
    completed = bytes.fromhex("6404 0e00 81 50 0100 68aaa001 0000 0000 30000080")
    framer = PROTOCOL.framer(End.HOST)
    framer.tell(0x50, status="dc")
    for _ in range(2):  # a header seen before takes another code path
        event = framer.feed(bytes.fromhex(before) + completed)[-1]
        assert isinstance(event, Received)
        assert isinstance(event.frame.message, m.MotMoveCompletedDc)
        assert event.frame.source == 0x50


def test_the_lowest_and_highest_sources_have_a_context() -> None:
    framer = PROTOCOL.framer(End.HOST)
    framer.tell(0, status="dc")
    framer.tell(0xFF, status="stepper")
    [event] = framer.feed(bytes.fromhex("6404 0e00 80 00 0100 68aaa001 0000 0000 30000080"))
    assert isinstance(event, Received)
    assert isinstance(event.frame.message, m.MotMoveCompletedDc)

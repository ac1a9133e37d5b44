"""Commands, setup commands and replies as values, and the frames that carry them."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from invented_commands import (
    PROTOCOL,
    TERMINATOR,
    Axis,
    ReadCount,
    ReadCountReply,
    ReadNameReply,
    ReadSpare,
    ReadState,
    Restart,
    Standby,
    Stop,
    WriteCount,
    WriteLimits,
    WritePage,
    WriteSpare,
)

from stagewire.errors import BadValueError, CodecError, OutOfRangeError, UnsupportedError
from stagewire.protocols import FORMS, Command, CommandFrame, Message

MOVE = WriteCount(-2)
RAW = bytes.fromhex("21 57 03 FE FF FF 0D")
MAXIMUM = 3 + 255 + 1


# Messages


def test_a_command_is_packed_for_an_axis_in_the_form_of_the_document() -> None:
    assert MOVE.pack(0x21) == RAW
    assert ReadCount().pack(0x22) == b"\x22\x63\x03\x0d"
    assert ReadState().pack(0x22) == b"\x22\x3f\x0d"
    assert Stop().pack(0x22) == b"\x22\x53\x00\x0d"


def test_an_axis_may_be_a_member_of_an_enumeration() -> None:
    assert MOVE.pack(Axis.LEFT) == RAW
    frame = CommandFrame(MOVE, Axis.LEFT)
    assert frame == CommandFrame(MOVE, 0x21)
    assert type(frame.axis) is int


def test_a_setup_command_is_the_prefix_and_its_byte() -> None:
    assert Restart().pack() == b"\x1b\x51"
    assert Standby().pack() == b"\x1b\x57"
    assert Standby.unpack(b"\x1b\x57") == Standby() != Restart()


def test_a_reply_is_only_its_data() -> None:
    assert ReadCountReply(-2).pack() == b"\xfe\xff\xff"
    assert ReadCountReply.unpack(b"\xfe\xff\xff") == ReadCountReply(-2)
    assert ReadCount.reply is ReadCountReply
    assert Stop.reply is None


@pytest.mark.parametrize("message", [MOVE, ReadCount(), Restart(), ReadNameReply("AB C"), Stop()])
def test_messages_are_values(message: Message) -> None:
    assert pickle.loads(pickle.dumps(message)) == message
    assert hash(message.replace()) == hash(message)
    with pytest.raises(AttributeError, match="immutable"):
        message.count = 5


@pytest.mark.parametrize("axis", [0, 1, 0x0C, 0x0E, 0x1A, 0x1C, 0x57, 0xFE, 0xFF])
def test_every_byte_except_two_is_an_axis(axis: int) -> None:
    assert MOVE.pack(axis) == bytes((axis,)) + RAW[1:]
    assert CommandFrame(MOVE, axis).axis == axis


@pytest.mark.parametrize(
    ("axis", "kind", "text"),
    [
        (0x1B, OutOfRangeError, "axis cannot be 0x1b, the prefix of setup commands"),
        (0x0D, OutOfRangeError, "axis cannot be 0x0d, the terminator of commands"),
        (-1, OutOfRangeError, "axis must be an identifier of one byte, not -1"),
        (256, OutOfRangeError, "axis must be an identifier of one byte, not 256"),
        (True, BadValueError, "axis must be the identifier of an axis, an integer, not True"),
        (None, BadValueError, "axis must be the identifier of an axis, an integer, not None"),
        ("X", BadValueError, "axis must be the identifier of an axis, an integer, not 'X'"),
    ],
)
@pytest.mark.parametrize("message", [MOVE, ReadCount()])
def test_invalid_axes(message: Command, axis: int, kind: type[CodecError], text: str) -> None:
    for call in (lambda: message.pack(axis), lambda: CommandFrame(message, axis)):
        with pytest.raises(kind) as caught:
            call()
        assert str(caught.value) == text


def test_a_dummy_is_refused_unless_allowed() -> None:
    for dummy, raw in (
        (WriteSpare(7), b"\x21\x73\x01\x07\x0d"),
        (ReadSpare(), b"\x21\x74\x01\x0d"),
    ):
        frame = CommandFrame(dummy, 0x21)
        for call in (lambda d=dummy: d.pack(0x21), frame.encode):
            with pytest.raises(UnsupportedError, match=r"_SPARE is a dummy .* allow_dummy"):
                call()
        assert dummy.pack(0x21, allow_dummy=True) == frame.encode(allow_dummy=True) == raw
        assert PROTOCOL.decode(raw) == frame
    assert MOVE.pack(0x21, allow_dummy=True) == RAW


# Frames


def test_a_frame_has_the_form_of_the_document_by_default() -> None:
    assert CommandFrame(ReadCount(), 0x21).sized is True
    assert CommandFrame(ReadState(), 0x21).sized is False
    assert CommandFrame(Restart()).sized is False
    for message in (ReadCount(), ReadState(), Stop(), MOVE):
        frame = CommandFrame(message, 0x21)
        assert frame.form == "request"
        assert frame.encode() == message.pack(0x21)
        assert frame == CommandFrame(message, 0x21, sized=frame.sized)


@pytest.mark.parametrize(
    ("message", "form", "raw"),
    [
        (ReadCount(), "request:without_size", b"\x21\x63\x0d"),
        (Stop(), "request:without_size", b"\x21\x53\x0d"),
        (ReadState(), "request:with_size", b"\x21\x3f\x00\x0d"),
        (ReadCount(), "request", b"\x21\x63\x03\x0d"),
    ],
)
def test_the_other_form(message: Command, form: str, raw: bytes) -> None:
    frame = CommandFrame(message, 0x21, sized=FORMS[form])
    assert frame.form == form
    assert frame.encode() == raw
    assert PROTOCOL.decode(raw) == frame


def test_forms_with_the_same_bytes_are_equal() -> None:
    assert CommandFrame(ReadState(), 0x21, sized=True) != CommandFrame(ReadState(), 0x21)
    assert CommandFrame(ReadState(), 0x21, sized=False) == CommandFrame(ReadState(), 0x21)


def test_extra_bytes_come_before_the_terminator() -> None:
    assert CommandFrame(MOVE, 0x21, b"\x01\x02").encode() == RAW[:-1] + b"\x01\x02\x0d"
    sized = CommandFrame(ReadState(), 0x21, b"\x09", sized=True)
    assert sized.encode() == b"\x21\x3f\x00\x09\x0d"
    assert CommandFrame(MOVE, 0x21, bytearray(b"ab")).extra == b"ab"


def test_the_longest_command() -> None:
    for message, room in ((MOVE, 252), (Stop(), 255)):
        frame = CommandFrame(message, 0x21, bytes(room))
        assert len(frame.encode()) == MAXIMUM
        assert PROTOCOL.decode(frame.encode()) == frame
        with pytest.raises(OutOfRangeError, match=f"extra must have at most {room} bytes, not"):
            CommandFrame(message, 0x21, bytes(room + 1))
    assert len(CommandFrame(WritePage(bytes(255)), 0x21).encode()) == MAXIMUM


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: CommandFrame(MOVE), "axis must be the identifier of an axis, an integer, not None"),
    (lambda: CommandFrame("move", 0x21), "a frame carries a command, not 'move'"),
    (lambda: CommandFrame(ReadCountReply(1), 0x21), "a frame carries a command, not ReadCountReply"),
    (lambda: CommandFrame(Restart(), 0x21), "RESTART is two bytes and has no axis"),
    (lambda: CommandFrame(Restart(), 0), "RESTART is two bytes and has no axis"),
    (lambda: CommandFrame(Restart(), extra=b"a"), "RESTART is two bytes and has no extra"),
    (lambda: CommandFrame(Restart(), sized=True), "RESTART is two bytes and has no sized"),
    (lambda: CommandFrame(MOVE, 0x21, "ab"), "extra must be bytes, not 'ab'"),
    (lambda: CommandFrame(MOVE, 0x21, b"\x01\x0d"), "extra holds 0x0d, which would end the command"),
    (lambda: CommandFrame(MOVE, 0x21, sized=1), "sized must be True, False or None, not 1"),
    (lambda: CommandFrame(MOVE, 0x21, sized=False), "WRITE_COUNT has data, so its size"),
    (lambda: CommandFrame(ReadState(), 0x21, b"a"), "READ_STATE without its size slot"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "text"), REFUSED)
def test_invalid_frames(call: Callable[[], object], text: str) -> None:
    with pytest.raises(BadValueError) as caught:
        call()
    assert str(caught.value).startswith(text)


def test_a_frame_is_a_value() -> None:
    frame = CommandFrame(MOVE, 0x21, b"ab")
    assert pickle.loads(pickle.dumps(frame)) == frame
    assert hash(frame) == hash(CommandFrame(WriteCount(-2), 0x21, b"ab"))
    for other in (
        CommandFrame(MOVE, 0x22, b"ab"),
        CommandFrame(MOVE, 0x21),
        CommandFrame(WriteCount(1), 0x21, b"ab"),
        MOVE,
    ):
        assert frame != other
    with pytest.raises(AttributeError, match="immutable"):
        frame.axis = 5
    with pytest.raises(AttributeError, match="cannot be deleted"):
        del frame.axis
    match frame:
        case CommandFrame(WriteCount(count), axis, extra):
            assert (count, axis, extra) == (-2, 0x21, b"ab")
        case _:
            pytest.fail("no match")


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (CommandFrame(MOVE, 0x21), "CommandFrame(WriteCount(count=-2), axis=0x21)"),
        (CommandFrame(Stop(), 5, b"a"), "CommandFrame(Stop(), axis=0x05, extra=b'a')"),
        (CommandFrame(Stop(), 5, sized=False), "CommandFrame(Stop(), axis=0x05, sized=False)"),
        (CommandFrame(Restart()), "CommandFrame(Restart())"),
    ],
)
def test_repr_of_a_frame(frame: CommandFrame, text: str) -> None:
    assert repr(frame) == text
    names = {
        "CommandFrame": CommandFrame,
        "WriteCount": WriteCount,
        "Stop": Stop,
        "Restart": Restart,
    }
    assert eval(text, names) == frame


# For any values

AXES = st.integers(0, 255).filter(lambda byte: byte not in (0x1B, TERMINATOR))
COMMANDS = st.one_of(
    st.sampled_from([ReadCount(), ReadState(), Stop()]),
    st.integers(-8_000_000, 8_000_000).map(WriteCount),
    st.builds(
        WriteLimits, st.sampled_from(["", "a", "\r\x1b"]), st.integers(0, 255),
        st.integers(-0x8000, 0x7FFF),
    ),
    st.binary(min_size=255, max_size=255).map(WritePage),
)  # fmt: skip
EXTRA = st.binary(max_size=40).filter(lambda data: TERMINATOR not in data)


@given(COMMANDS, AXES, EXTRA, st.sampled_from([None, True, False]))
def test_encoded_frames_decode_to_equal_ones(
    message: Command, axis: int, extra: bytes, sized: bool | None
) -> None:
    frame = CommandFrame(message, axis, sized=None if message.layout.length else sized)
    if frame.sized and message.layout.length < 255:
        frame = CommandFrame(message, axis, extra, frame.sized)
    assert PROTOCOL.decode(frame.encode()) == frame


@given(st.integers(-(1 << 23), (1 << 23) - 1), AXES)
def test_a_decoded_value_out_of_range_is_kept_and_encoded_unchanged(count: int, axis: int) -> None:
    raw = bytes((axis, 0x57, 3)) + count.to_bytes(3, "little", signed=True) + b"\x0d"
    frame = PROTOCOL.decode(raw)
    assert frame.message.count == count
    assert frame.encode() == raw

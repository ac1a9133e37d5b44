"""Decoding commands and replies, building them by name, and the messages of all errors."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from invented_commands import (
    MESSAGES,
    PROTOCOL,
    Escape,
    ReadCount,
    ReadCountReply,
    ReadNameReply,
    ReadState,
    ReadStateReply,
    Restart,
    Standby,
    Stop,
    WriteCount,
    WriteLimits,
    layout,
)

from stagewire.errors import (
    BadLengthError,
    BadValueError,
    CodecError,
    MissingFieldError,
    OutOfRangeError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
)
from stagewire.framing import CommandReceived
from stagewire.protocols import Command, CommandFrame, CommandProtocol, SetupCommand


def b(text: str) -> bytes:
    return bytes.fromhex(text)


def test_the_attributes_of_the_protocol() -> None:
    assert repr(PROTOCOL) == "<Protocol invented: 13 messages>"
    assert PROTOCOL.axes == {"LEFT": 0x21, "RIGHT": 0x22}
    assert PROTOCOL.marks.setup == {0x51: "RESTART", 0x57: "STANDBY", 0x1B: "ESCAPE"}


@pytest.mark.parametrize(
    ("raw", "frame"),
    [
        ("21 57 03 FE FF FF 0D", CommandFrame(WriteCount(-2), 0x21)),
        ("21 57 03 0D 0D 0D 0D", CommandFrame(WriteCount(0x0D0D0D), 0x21)),
        ("57 57 03 00 00 80 0D", CommandFrame(WriteCount.keep({"count": -(1 << 23)}), 0x57)),
        ("21 63 03 0D", CommandFrame(ReadCount(), 0x21)),
        ("21 63 0D", CommandFrame(ReadCount(), 0x21, sized=False)),
        ("21 3F 0D", CommandFrame(ReadState(), 0x21)),
        ("21 3F 00 0D", CommandFrame(ReadState(), 0x21, sized=True)),
        ("21 63 03 41 42 0D", CommandFrame(ReadCount(), 0x21, b"AB")),
        ("21 57 03 01 00 00 21 3F 0D", CommandFrame(WriteCount(1), 0x21, b"!?")),
        ("21 4C 05 61 00 07 FE FF 0D", CommandFrame(WriteLimits("a", 7, -2), 0x21)),
        ("1B 51", CommandFrame(Restart())),
        ("1B 57", CommandFrame(Standby())),
        ("1B 1B", CommandFrame(Escape())),
    ],
)
def test_decoding(raw: str, frame: CommandFrame) -> None:
    for data in (b(raw), bytearray(b(raw)), memoryview(b(raw))):
        assert PROTOCOL.decode(data) == frame  # type: ignore[arg-type]
    assert frame.encode() == b(raw)


def test_a_reply_is_decoded_with_its_command() -> None:
    frame = CommandFrame(ReadCount(), 0x21)
    for command in ("READ_COUNT", ReadCount, ReadCount(), frame):
        for data in (b("FE FF FF"), bytearray(b("FE FF FF"))):
            assert PROTOCOL.decode_reply(data, command) == ReadCountReply(-2)  # type: ignore[arg-type]
    assert PROTOCOL.decode_reply(b"B", "READ_STATE") == ReadStateReply(0x42)
    assert PROTOCOL.decode_reply(b"AB \r\0\0", "READ_NAME") == ReadNameReply.keep(
        {"name": "AB \r\0\0"}
    )


# By name


def test_a_name_selects_the_command_unless_a_form_is_given() -> None:
    assert PROTOCOL.message_class("READ_COUNT") is ReadCount
    assert PROTOCOL.message_class("READ_COUNT", "request") is ReadCount
    assert PROTOCOL.message_class("READ_COUNT", "reply") is ReadCountReply
    assert PROTOCOL.message_class("RESTART") is Restart
    assert PROTOCOL.message_class("READ_COUNT", "request:without_size") is ReadCount
    assert PROTOCOL.message_class("READ_STATE", "request:with_size") is ReadState
    assert PROTOCOL.message_class("STOP", "request:without_size") is Stop


def test_messages_are_built_by_name() -> None:
    assert PROTOCOL.build("WRITE_COUNT", {"count": 5}) == WriteCount(5)
    assert PROTOCOL.build("READ_COUNT", {}, "request:without_size") == ReadCount()
    assert PROTOCOL.build("READ_COUNT", {"count": 5}, "reply") == ReadCountReply(5)
    assert PROTOCOL.build("STANDBY", {}) == Standby()


BYTE = "byte 1 is the byte of the command"
REFUSALS: list[tuple[Callable[[], object], type[CodecError], str]] = [
    # Bytes
    (
        lambda: PROTOCOL.decode(b""),
        TruncatedError,
        "a command begins with its axis or the prefix of a setup command; the bytes end before byte 0",
    ),
    (lambda: PROTOCOL.decode(b("21")), TruncatedError, f"{BYTE}; the bytes end before byte 1"),
    (lambda: PROTOCOL.decode(b("1B")), TruncatedError, f"{BYTE}; the bytes end before byte 1"),
    (
        lambda: PROTOCOL.decode(b("21 57")),
        TruncatedError,
        "WRITE_COUNT: byte 2 is its size, 3; the bytes end before byte 2",
    ),
    (
        lambda: PROTOCOL.decode(b("0D")),
        BadLengthError,
        "byte 0: 0x0d ends a command that has no axis",
    ),
    (
        lambda: PROTOCOL.decode(b("21 0D")),
        BadLengthError,
        "byte 1: 0x0d aborts a command that has no byte",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 03 0D 0D")),
        TruncatedError,
        "WRITE_COUNT: expected 3 bytes of data and 0x0d; the bytes end before byte 5",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 03 0D 0D 0D")),
        TruncatedError,
        "WRITE_COUNT: expected 3 bytes of data and 0x0d; the bytes end before byte 6",
    ),
    (
        lambda: PROTOCOL.decode(b("21 63 03 21")),
        TruncatedError,
        "READ_COUNT: expected 0x0d; the bytes end before byte 4",
    ),
    (
        lambda: PROTOCOL.decode(b("21 63 03")),
        TruncatedError,
        "READ_COUNT: expected 0x0d; the bytes end before byte 3",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 03 01 02 03 0D 21 0D")),
        TrailingBytesError,
        "WRITE_COUNT ends before byte 7; found 2 more bytes",
    ),
    (
        lambda: PROTOCOL.decode(b("1B 51 0D")),
        TrailingBytesError,
        "RESTART ends before byte 2; found 1 more byte",
    ),
    (
        lambda: PROTOCOL.decode(b("21 63 0D 0D")),
        TrailingBytesError,
        "READ_COUNT ends before byte 3; found 1 more byte",
    ),
    (
        lambda: PROTOCOL.decode(b("21 99 03 0D")),
        UnknownMessageError,
        "byte 1: no command of Invented commands has the byte 0x99",
    ),
    (
        lambda: PROTOCOL.decode(b("21 51")),
        UnknownMessageError,
        "byte 1: no command of Invented commands has the byte 0x51",
    ),
    (
        lambda: PROTOCOL.decode(b("1B 63 0D")),
        UnknownMessageError,
        "byte 1: no setup command of Invented commands has the byte 0x63",
    ),
    (
        lambda: PROTOCOL.decode(b("1B 0D")),
        UnknownMessageError,
        "byte 1: no setup command of Invented commands has the byte 0x0d",
    ),
    (
        lambda: PROTOCOL.decode(b("21 63 04 0D")),
        BadLengthError,
        "READ_COUNT: byte 2 is its size, 3, or 0x0d to leave it out; not 4",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 04")),
        BadLengthError,
        "WRITE_COUNT: byte 2 is its size, 3; not 4",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 0D")),
        BadLengthError,
        "WRITE_COUNT: byte 2 is its size, 3; not 0x0d, which leaves it out",
    ),
    (
        lambda: PROTOCOL.decode(b("21 57 03") + bytes(256) + b("0D")),
        BadLengthError,
        "WRITE_COUNT: 0x0d must follow within 259 bytes",
    ),
    (
        lambda: PROTOCOL.decode(b("21 99") + b("01") * 300),
        UnknownMessageError,
        "byte 1: no command of Invented commands has the byte 0x99",
    ),
    (
        lambda: PROTOCOL.decode(b("0D 21 63 0D")),
        BadLengthError,
        "byte 0: 0x0d ends a command that has no axis",
    ),
    (
        lambda: PROTOCOL.decode("21 63"),  # type: ignore[arg-type]
        BadValueError,
        "decode takes bytes, not str; use bytes.fromhex to convert hex text",
    ),
    # Replies
    (
        lambda: PROTOCOL.decode_reply(b"ab", "READ_COUNT"),
        TruncatedError,
        "the reply to READ_COUNT has 3 bytes, not 2",
    ),
    (
        lambda: PROTOCOL.decode_reply(b"abcd", ReadCount()),
        TrailingBytesError,
        "the reply to READ_COUNT has 3 bytes, not 4",
    ),
    (lambda: PROTOCOL.decode_reply(b"", "STOP"), BadLengthError, "STOP has no reply"),
    (lambda: PROTOCOL.decode_reply(b"", Restart), BadLengthError, "RESTART has no reply"),
    (
        lambda: PROTOCOL.decode_reply(b"", "READ_COUNTS"),
        UnknownMessageError,
        "Invented commands has no message READ_COUNTS; did you mean READ_COUNT or WRITE_COUNT "
        "or READ_NAME?",
    ),
    (
        lambda: PROTOCOL.decode_reply(b"abc", 5),  # type: ignore[arg-type]
        BadValueError,
        "decode_reply takes the command of the reply, not 5",
    ),
    (
        lambda: PROTOCOL.decode_reply(b"abc", ReadCountReply),
        BadValueError,
        "decode_reply takes the command of the reply, not <class 'invented_commands.ReadCountReply'>",
    ),
    (
        lambda: PROTOCOL.decode_reply("abc", "READ_COUNT"),  # type: ignore[arg-type]
        BadValueError,
        "decode takes bytes, not str; use bytes.fromhex to convert hex text",
    ),
    # Names and values
    (
        lambda: PROTOCOL.message_class("STOP", "reply"),
        BadLengthError,
        "STOP has no form reply (it has request, request:without_size)",
    ),
    (
        lambda: PROTOCOL.message_class("WRITE_COUNT", "request:without_size"),
        BadLengthError,
        "WRITE_COUNT has no form request:without_size (it has request)",
    ),
    (
        lambda: PROTOCOL.build("WRITE_COUNT", {}),
        MissingFieldError,
        "WRITE_COUNT (request) lacks count",
    ),
    (
        lambda: PROTOCOL.build("READ_COUNT", {"count": 5}),
        UnknownFieldError,
        "READ_COUNT (request) has no field count: no fields",
    ),
    (
        lambda: PROTOCOL.build("WRITE_COUNT", {"count": 8_000_001}),
        OutOfRangeError,
        "WRITE_COUNT.count must be -8000000 to 8000000 (raw counts), not 8000001",
    ),
]


@pytest.mark.parametrize(("call", "kind", "text"), REFUSALS)
def test_error_messages(call: Callable[[], object], kind: type[CodecError], text: str) -> None:
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind
    assert str(caught.value) == text


# Invalid protocols


def command(byte: int, length: int = 0, size: int | None = 0) -> type[Command]:
    class Made(Command):
        __slots__ = ()
        layout = layout("MADE", byte, "request", (), length, size=size)

    return Made


def setup_command(byte: int) -> type[SetupCommand]:
    class Made(SetupCommand):
        __slots__ = ()
        layout = layout("MADE", byte, "request", (), 0, kind="setup")

    return Made


def protocol(*classes: type, prefix: int = 0xFE, terminator: int = 0x2E) -> CommandProtocol:
    return CommandProtocol("made", "Made", "made", classes, prefix, terminator, {})


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: protocol(command(5), command(5)), "MADE and MADE have the same byte 0x05"),
        (lambda: protocol(setup_command(5), setup_command(5)), "have the same byte 0x05"),
        (lambda: protocol(command(0x2E)), "MADE: a command cannot have the byte 0x2e"),
        (lambda: protocol(command(256)), "MADE: a command cannot have the byte 0x100"),
        (lambda: protocol(command(5, size=0x2E)), "MADE: a size slot cannot hold 46"),
        (lambda: protocol(command(5, 256, 256)), "MADE: a size slot cannot hold 256"),
        (lambda: protocol(command(5, 3, 2)), "MADE: 3 bytes of data do not match the size 2"),
        (lambda: protocol(command(5, 3, None)), "MADE: 3 bytes of data do not match the size 0"),
        (lambda: protocol(setup_command(0x2E)), "MADE: 0x2e is the terminator"),
        (lambda: protocol(setup_command(256)), "0x100 is not a byte"),
        (lambda: protocol(prefix=5, terminator=5), "cannot be both the prefix and the terminator"),
        (lambda: protocol(prefix=-1), "-0x1 is not a byte"),
    ],
)
def test_invalid_commands_are_refused(make: Callable[[], object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        make()


def test_the_marks_come_from_the_protocol_not_the_runtime() -> None:
    cls, reset = command(0x3A, size=2), setup_command(0x41)
    made = protocol(cls, reset, prefix=0x00, terminator=0xFF)
    assert cls().pack(0x3A) == b"\x3a\x3a\x02\xff"
    assert reset().pack() == b"\x00\x41"
    events = made.framer().feed(b"\x3a\x3a\x02\xff\x00\x41\x3a\x3a\xff")
    assert [event.raw.hex() for event in events] == ["3a3a02ff", "0041", "3a3aff"]
    assert all(isinstance(event, CommandReceived) for event in events)


def test_a_class_belongs_to_one_protocol() -> None:
    cls = command(0x3A, size=2)
    protocol(cls, prefix=0x00, terminator=0xFF)
    protocol(cls, prefix=0x00, terminator=0xFF)
    with pytest.raises(ValueError, match="belongs to a protocol with other marks"):
        protocol(cls, prefix=0x01, terminator=0xFF)
    assert cls().pack(0x3B) == b"\x3b\x3a\x02\xff"


@pytest.mark.parametrize(
    ("raw", "at"),
    [
        ("", range(1)),
        ("0D 21", range(1)),
        ("21", range(1, 2)),
        ("21 0D", range(1, 2)),
        ("1B 0D", range(1, 2)),
        ("21 99 03 0D", range(1, 2)),
        ("21 57", range(2, 3)),
        ("21 63 04 0D", range(2, 3)),
        ("21 57 03 0D 0D", range(5, 6)),
        ("21 63 0D 0D", range(3, 4)),
        ("1B 51 0D 0D", range(2, 4)),
        ("21 63 03" + " 01" * 300, range(258, 259)),
    ],
)
def test_errors_name_the_wrong_bytes(raw: str, at: range) -> None:
    with pytest.raises(CodecError) as caught:
        PROTOCOL.decode(b(raw))
    assert caught.value.at == at


# For any bytes


@given(
    st.one_of(
        st.binary(max_size=9),
        st.tuples(
            st.sampled_from([0x21, 0x1B, 0x0D]),
            st.sampled_from([cls.layout.id for cls in MESSAGES]),
            st.sampled_from([0x00, 0x01, 0x03, 0x05, 0x08, 0x0D]),
            st.binary(max_size=9),
            st.sampled_from([b"", b"\x0d"]),
        ).map(lambda parts: bytes(parts[:3]) + parts[3] + parts[4]),
    )
)
def test_decode_accepts_what_the_framer_returns_as_one_command(raw: bytes) -> None:
    framer = PROTOCOL.framer()
    events = framer.feed(raw)
    one = len(events) == 1 and isinstance(events[0], CommandReceived) and not framer.pending
    try:
        frame = PROTOCOL.decode(raw)
    except (TruncatedError, TrailingBytesError, BadLengthError, UnknownMessageError):
        assert not one
    else:
        assert one
        assert frame.encode(allow_dummy=True) == raw

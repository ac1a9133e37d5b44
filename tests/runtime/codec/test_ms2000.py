"""The codec of the MS-2000 over the whole ranges of its values; its framer over every split and damage.

The facts are typed from the document, not read from the registry.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise
from random import Random
from typing import Any

import framing_references as references
import pytest
from framing_references import Piece, command_reference
from hypothesis import example, given
from hypothesis import strategies as st

from stagewire.errors import OutOfRangeError, UnsupportedError
from stagewire.framing import Garbage, ReplyReceived
from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL, quantities
from stagewire_ms2000 import messages as m
from stagewire_ms2000.enumerations import Axis

X = Axis.X
LONGEST = 3 + 255 + 1

# byte -> bytes of data, number in the size slot, and whether the document sends the slot
COMMANDS = {
    0x3F: (0, 0, False), 0x47: (0, 0, False), 0x42: (0, 0, False),
    0x61: (0, 3, True), 0x64: (0, 3, True), 0x69: (0, 6, True), 0x6C: (0, 4, True),
    0x6F: (0, 2, True), 0x71: (0, 1, True), 0x72: (0, 2, True), 0x73: (0, 2, True),
    0x74: (0, 3, True), 0x7E: (0, 1, True),
    0x2B: (0, 0, True), 0x2D: (0, 0, True), 0x4A: (0, 0, True), 0x4B: (0, 0, True),
    0x41: (3, 3, True), 0x54: (3, 3, True), 0x44: (3, 3, True),
    0x51: (1, 1, True), 0x52: (2, 2, True), 0x53: (2, 2, True), 0x5E: (2, 2, True),
}  # fmt: skip
SETUP = {0x41, 0x42, 0x48, 0x52, 0x54}
REPLIES = {
    0x3F: 1, 0x61: 3, 0x64: 3, 0x69: 6, 0x6C: 4, 0x6F: 2, 0x71: 1, 0x72: 2, 0x73: 2, 0x74: 3, 0x7E: 1,
}  # fmt: skip
POSITIONS = [
    (m.WriteMotorPosition, 0x41, "position"),
    (m.WriteTargetPosition, 0x54, "target_position"),
    (m.WriteIncrementValue, 0x44, "increment"),
]
READ_POSITIONS = [
    (m.ReadMotorPosition, "position"),
    (m.ReadTargetPosition, "target_position"),
    (m.ReadIncrementValue, "increment"),
]
REFERENCE = command_reference(
    0xFF, 0x3A, SETUP, {byte: (length, size) for byte, (length, size, _) in COMMANDS.items()}
)


def b(text: str) -> bytes:
    return bytes.fromhex(text)


def pieces(stream: bytes, edges: list[int] | None = None) -> list[Piece]:
    """Frame a stream cut at the given positions; return the events as the reference describes them."""
    chunks = [stream[start:stop] for start, stop in pairwise(edges or [0, len(stream)])]
    return references.pieces(PROTOCOL.framer(), chunks, LONGEST)


def commands() -> Iterator[bytes]:
    """Yield every command in every form, with data that looks like a terminator or a setup command."""
    for byte, (length, size, _) in COMMANDS.items():
        head = bytes((0x18, byte))
        for data in (b("3A 3A 3A"), b("FF 41 3A"), b("3A FF 52")):
            yield head + bytes((size,)) + data[:length] + b":"
            if not length:
                break
        if not length:
            yield head + b":"
    for byte in SETUP:
        yield bytes((0xFF, byte))


EVERY = sorted(commands())


# Values


S24 = st.integers(-(1 << 23), (1 << 23) - 1)
U16 = st.integers(0, 0xFFFF)


@given(S24, st.sampled_from(POSITIONS), st.sampled_from(Axis))
@example(0x3A3A3A, POSITIONS[1], Axis.X)
@example(0x41FF, POSITIONS[1], Axis.X)
@example(-1, POSITIONS[0], Axis.Z)
@example(-(1 << 23), POSITIONS[1], Axis.Y)
@example((1 << 23) - 1, POSITIONS[1], Axis.Y)
def test_every_position_survives_a_round_trip(
    counts: int, kind: tuple[Any, int, str], axis: Axis
) -> None:
    cls, byte, field = kind
    raw = cls(counts).pack(axis)
    low, middle, high = counts & 0xFF, counts >> 8 & 0xFF, counts >> 16 & 0xFF
    assert raw == bytes((axis, byte, 3, low, middle, high, 0x3A))
    frame = PROTOCOL.decode(raw)
    assert frame == CommandFrame(cls(counts), axis)
    assert getattr(frame.message, field) == counts
    assert pieces(raw + raw) == [Piece("message", raw)] * 2


@given(S24, st.sampled_from(READ_POSITIONS))
@example(0x3A3A3A, READ_POSITIONS[0])
@example(-1, READ_POSITIONS[0])
def test_every_position_is_read(counts: int, kind: tuple[type[Command], str]) -> None:
    cls, field = kind
    raw = bytes((counts & 0xFF, counts >> 8 & 0xFF, counts >> 16 & 0xFF))
    reply: Any = PROTOCOL.decode_reply(raw, cls)
    assert getattr(reply, field) == counts
    assert reply.pack() == raw
    assert cls.reply is not None
    assert cls.reply(counts) == reply


@given(S24, st.integers(0, 255))
def test_position_and_status_are_read(counts: int, status: int) -> None:
    raw = bytes((counts & 0xFF, counts >> 8 & 0xFF, counts >> 16 & 0xFF, status))
    reply = m.ReadMotorPositionAndStatusReply(counts, status)
    assert reply.pack() == raw
    assert PROTOCOL.decode_reply(raw, "READ_MOTOR_POSITION_AND_STATUS") == reply


@given(U16)
def test_every_speed_without_a_sign(speed: int) -> None:
    data = bytes((speed & 0xFF, speed >> 8))
    raw = b("18 53 02") + data + b":"
    assert m.WriteTopSpeed(speed).pack(X) == raw
    assert PROTOCOL.decode(raw).message == m.WriteTopSpeed(speed)
    reply: Any = PROTOCOL.decode_reply(data, "READ_MAXIMUM_SPEED")
    assert reply.maximum_speed == speed
    assert reply.pack() == data
    vector = b("18 5E 02") + data + b":"
    frame: Any = PROTOCOL.decode(vector)
    assert frame.message.vector_speed == speed
    assert frame.encode() == vector


@given(st.integers(-0x8000, 0x7FFF))
def test_every_speed_with_a_sign(speed: int) -> None:
    raw = bytes((speed & 0xFF, speed >> 8 & 0xFF))
    assert m.ReadCurrentSpeedReply(speed).pack() == raw
    assert PROTOCOL.decode_reply(raw, m.ReadCurrentSpeed) == m.ReadCurrentSpeedReply(speed)


@pytest.mark.parametrize(
    ("make", "lowest", "highest"),
    [
        (m.WriteMotorPosition, -(1 << 23), (1 << 23) - 1),
        (m.WriteTargetPosition, -(1 << 23), (1 << 23) - 1),
        (m.WriteIncrementValue, -(1 << 23), (1 << 23) - 1),
        (m.ReadMotorPositionReply, -(1 << 23), (1 << 23) - 1),
        (m.ReadCurrentSpeedReply, -0x8000, 0x7FFF),
        (m.WriteTopSpeed, 0, 0xFFFF),
        (m.ReadMaximumSpeedReply, 0, 0xFFFF),
        (m.WriteVectorSpeed, 0, 0x7FFF),
        (m.WriteRampingTime, 1, 255),
        (m.ReadRampTimeReply, 1, 255),
    ],
)
def test_values_neither_wrap_nor_are_clamped(make: Any, lowest: int, highest: int) -> None:
    for value in (lowest, highest):
        assert next(iter(make(value).values().values())) == value
    for value in (lowest - 1, highest + 1, 1 << 24, -(1 << 24)):
        with pytest.raises(OutOfRangeError):
            make(value)


@pytest.mark.parametrize(
    ("micrometres", "counts"),
    [("-0.04", 0), ("-0.05", -1), ("-0.15", -2), ("0.05", 1), (-10000, -100000), (10000, 100000)],
)
def test_positions_round_to_the_nearest_count_also_below_zero(
    micrometres: str | int, counts: int
) -> None:
    assert quantities.POSITION.to_counts(micrometres) == counts


# Commands


@pytest.mark.parametrize("byte", sorted(COMMANDS))
def test_commands_without_data_have_two_forms_and_are_sent_as_documented(
    byte: int,
) -> None:
    length, size, sized = COMMANDS[byte]
    if length:
        raw = bytes((0x18, byte, size)) + bytes((1,) * length) + b":"
        assert PROTOCOL.decode(raw).encode(allow_dummy=True) == raw
        return
    forms = {True: bytes((0x18, byte, size)) + b":", False: bytes((0x18, byte)) + b":"}
    for form, raw in forms.items():
        frame = PROTOCOL.decode(raw)
        assert frame.sized is form
        assert frame.encode(allow_dummy=True) == raw
    message: Any = frame.message
    assert message.pack(X, allow_dummy=True) == forms[sized]


@pytest.mark.parametrize("byte", sorted(SETUP))
def test_setup_commands_differ_from_commands_with_the_same_byte(byte: int) -> None:
    frame = PROTOCOL.decode(bytes((0xFF, byte)))
    assert frame.axis is None
    assert frame.message.layout.kind == "setup"
    assert frame.encode() == bytes((0xFF, byte))
    if byte in COMMANDS:
        length, size, _ = COMMANDS[byte]
        raw = bytes((0x18, byte, size)) + bytes(length) + b":"
        assert PROTOCOL.decode(raw).message.layout.kind == "command"
        assert pieces(bytes((0xFF, byte)) + raw) == [
            Piece("message", bytes((0xFF, byte))),
            Piece("message", raw),
        ]


def test_dummies_are_encoded_only_if_allowed() -> None:
    for dummy in (m.ReadStartSpeed(), m.WriteStartSpeed(5)):
        with pytest.raises(UnsupportedError):
            CommandFrame(dummy, X).encode()
        assert CommandFrame(dummy, X).encode(allow_dummy=True)[0] == 0x18


@pytest.mark.parametrize(
    ("message", "below", "above"),
    [
        (m.WriteTargetPosition(0x41FF), 0x41FE, 0x4200),
        (m.WriteTargetPosition(0x42FF10), 0x42FEFF, 0x430000),
        (m.WriteTargetPosition(0x54FF00), 0x54FEFF, 0x550000),
        (m.WriteTopSpeed(0x52FF), 0x52FE, 0x5300),
        (m.WriteVectorSpeed(0x48FF), 0x48FE, 0x4900),
    ],
)
def test_values_that_look_like_a_setup_command_are_refused_on_request(
    message: Command, below: int, above: int
) -> None:
    frame = CommandFrame(message, X)
    assert frame.encode() == message.pack(X)
    with pytest.raises(OutOfRangeError, match=f"the nearest safe values are {below} and {above}$"):
        frame.encode(refuse_prefix_bytes=True)


@given(S24)
@example(0x41FF)
@example(0x3A41FF)
@example(-0xBE01)
def test_no_accepted_value_contains_a_setup_command(counts: int) -> None:
    frame = CommandFrame(m.WriteTargetPosition(counts), X)
    raw = frame.encode()
    looks = any(first == 0xFF and second in SETUP for first, second in pairwise(raw))
    if looks:
        with pytest.raises(OutOfRangeError):
            frame.encode(refuse_prefix_bytes=True)
    else:
        assert frame.encode(refuse_prefix_bytes=True) == raw


# Streams


def test_every_command_is_covered() -> None:
    assert {raw[1] for raw in EVERY if raw[0] != 0xFF} == set(COMMANDS)
    assert {raw[1] for raw in EVERY if raw[0] == 0xFF} == SETUP
    kinds = {(cls.layout.kind, cls.layout.id) for cls in PROTOCOL.messages}
    assert kinds == {("command", byte) for byte in COMMANDS} | {("setup", byte) for byte in SETUP}


@pytest.mark.parametrize("raw", EVERY, ids=lambda raw: raw.hex(" "))
def test_every_split_of_every_command(raw: bytes) -> None:
    stream = raw + b("18 54 03 3A FF 41 3A") + raw
    expected = [Piece("message", part) for part in (raw, stream[len(raw) : -len(raw)], raw)]
    places = range(1, len(stream))
    for number in (1, 2, 3):
        for cuts in combinations(places, number):
            assert pieces(stream, [0, *cuts, len(stream)]) == expected
    assert pieces(stream, list(range(len(stream) + 1))) == expected


@pytest.mark.parametrize(
    ("stream", "found"),
    [
        # a lost byte: the next command becomes data and extra bytes of the previous one
        ("18 54 03 A0 86 3A 18 3F 3A", [("message", "18 54 03 A0 86 3A 18 3F 3A")]),
        ("18 54 A0 86 01 3A 18 3F 3A", [("bad_length", "18 54 A0 86 01 3A"), ("message", "18 3F 3A")]),
        ("54 03 A0 86 01 3A 18 3F 3A", [("unknown", "54 03 A0 86 01 3A"), ("message", "18 3F 3A")]),
        ("18 03 A0 86 01 3A 18 3F 3A", [("unknown", "18 03 A0 86 01 3A"), ("message", "18 3F 3A")]),
        # surplus bytes
        ("18 54 03 A0 86 01 00 3A", [("message", "18 54 03 A0 86 01 00 3A")]),
        ("00 18 54 03 A0 86 3A 18 3F 3A", [("unknown", "00 18 54 03 A0 86 3A"), ("message", "18 3F 3A")]),
        ("0D 0A 3A 18 3F 3A", [("unknown", "0D 0A 3A"), ("message", "18 3F 3A")]),
        ("3A 3A 3A 18 3F 3A", [("garbage", "3A 3A 3A"), ("message", "18 3F 3A")]),
        # colons after half a command are data and do not end it
        ("18 54 03 3A 3A 3A", [("pending", "18 54 03 3A 3A 3A")]),
        ("18 54 03 3A 3A 3A 3A", [("message", "18 54 03 3A 3A 3A 3A")]),
        # the document's own example of a wrong size
        ("18 6C 03 3A 18 6C 04 3A", [("bad_length", "18 6C 03 3A"), ("message", "18 6C 04 3A")]),
        ("FF 58 18 3F 3A FF 52", [("garbage", "FF 58 18 3F 3A"), ("message", "FF 52")]),
        ("18 3A 18 3F 3A", [("garbage", "18 3A"), ("message", "18 3F 3A")]),
    ],
)  # fmt: skip
def test_lost_bytes_and_surplus_bytes(stream: str, found: list[tuple[str, str]]) -> None:
    data = b(stream)
    expected = [Piece(kind, b(raw)) for kind, raw in found]
    assert pieces(data) == expected == REFERENCE.read(data)
    assert pieces(data, list(range(len(data) + 1))) == expected


def test_a_lost_byte_can_cause_a_move() -> None:
    frame = PROTOCOL.decode(b("18 54 03 A0 86 3A 18 3F 3A"))
    assert frame == CommandFrame(m.WriteTargetPosition(3835552), X, b("18 3F"))


@pytest.mark.parametrize(
    "flood", ["18 54 03", "18 61 03", "18", "FF", "FF 58", "18 99", "00", "18 54 04"]
)
@pytest.mark.parametrize("size", [1, 4096, 1 << 20])
def test_floods_without_a_colon(flood: str, size: int) -> None:
    data = b(flood) * (20_000 // len(b(flood)))
    framer = PROTOCOL.framer()
    given_out = 0
    for start in range(0, len(data), size):
        given_out += sum(len(event.raw) for event in framer.feed(data[start : start + size]))
        assert len(framer.pending) < LONGEST
    assert given_out + len(framer.pending) == len(data)
    assert given_out >= len(data) - LONGEST


def test_the_framer_agrees_with_the_reference_on_damaged_streams() -> None:
    rng = Random(1)
    for _ in range(4000):
        stream = bytearray(b"".join(rng.choices(EVERY, k=rng.randrange(1, 10))))
        for _ in range(rng.randrange(4)):
            at = rng.randrange(len(stream) + 1)
            kind = rng.randrange(4)
            if kind == 0:
                del stream[at : at + rng.randrange(1, 3)]
            elif kind == 1:
                stream[at:at] = rng.randbytes(rng.choice((1, 1, 2, 270)))
            elif at < len(stream):
                stream[at] = rng.choice((0x3A, 0xFF, 0x18, 0x03, rng.randrange(256)))
        data = bytes(stream)
        expected = REFERENCE.read(data)
        assert pieces(data) == expected
        cuts = sorted(rng.randrange(len(data) + 1) for _ in range(rng.randrange(4)))
        assert pieces(data, [0, *cuts, len(data)]) == expected


@given(
    st.lists(st.one_of(st.sampled_from(EVERY), st.binary(max_size=6)), max_size=12).map(b"".join)
)
def test_the_framer_agrees_with_the_reference_on_any_bytes(data: bytes) -> None:
    expected = REFERENCE.read(data)
    assert pieces(data) == expected
    assert pieces(data, list(range(len(data) + 1))) == expected


# Replies


@pytest.mark.parametrize("byte", sorted(COMMANDS))
def test_every_split_of_every_reply(byte: int) -> None:
    request = next(
        PROTOCOL.decode(raw) for raw in EVERY if raw[0] != 0xFF and raw[1] == byte
    )  # fmt: skip
    length = REPLIES.get(byte, 0)
    assert bool(length) == (request.message.reply is not None)  # type: ignore[union-attr]
    data = b("3A FF 41 3A 3A 3A")[:length]
    for number in range(length):
        for cuts in combinations(range(1, length), number):
            decoder = PROTOCOL.replies()
            decoder.sent(request)
            events = []
            for start, stop in pairwise([0, *cuts, length]):
                events += decoder.feed(data[start:stop])
            (event,) = events
            assert event == ReplyReceived(data, request)
            assert isinstance(event, ReplyReceived)
            assert event.reply.pack() == data
            assert decoder.feed(b":") == [Garbage(b":")]


def test_only_the_request_distinguishes_replies_of_equal_length() -> None:
    decoder = PROTOCOL.replies()
    for cls in (m.ReadMotorPosition, m.ReadTargetPosition, m.ReadIncrementValue):
        decoder.sent(CommandFrame(cls(), X))
        (event,) = decoder.feed(b("A0 86 01"))
        assert isinstance(event, ReplyReceived)
        assert cls.reply is not None
        assert event.reply == cls.reply(100_000)

"""Packets: valid and invalid shapes, messages with addresses and extra bytes, error messages."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from invented_packets import (
    PROTOCOL,
    SHAPES,
    Page,
    SetAngle,
    State,
    StateBrief,
    StateFull,
    Stop,
    protocol_of,
)
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    CodecError,
    DamagedError,
    MissingFieldError,
    OutOfRangeError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnsupportedError,
)
from stagewire.framing import PacketReceived
from stagewire.protocols import (
    Crc,
    Direction,
    Layout,
    Packet,
    PacketMessage,
    PacketProtocol,
    Shape,
    Sum,
    Xor,
)

USUAL = SHAPES["usual"]
PROTOCOLS = {name: protocol_of(shape) for name, shape in SHAPES.items()}


def with_check(raw: bytes) -> bytes:
    """Return a packet of the usual shape with the right check."""
    return raw[:-3] + USUAL.check_of(raw).to_bytes(2, "little") + raw[-1:]


MOVE = with_check(bytes.fromhex("AA55 08 07 02 A08601 0A00 00 0000 0D"))

# Bytes


def test_a_packet_byte_by_byte() -> None:
    packet = Packet(SetAngle(100_000, 10), address=7)
    raw = packet.encode()
    assert raw[:11] == MOVE[:11]
    assert raw[11:13] == USUAL.check.of(raw[2:11]).to_bytes(2, "little")  # type: ignore[union-attr]
    assert raw[13:] == b"\x0d"
    assert PROTOCOL.decode(raw) == packet


@pytest.mark.parametrize(
    ("shape", "raw"),
    [
        ("small", "02 02 03 3412 25"),
        ("ended", "02 0300 0B00 3412 BAFF 030A"),
        ("odd", "AAAA55 03 05 3412 4B 0200"),
        ("bare", "AA 02 03 3412"),
    ],
)
def test_the_same_message_in_other_shapes(shape: str, raw: str) -> None:
    protocol = PROTOCOLS[shape]
    message = protocol.build("STATE", {"bits": 0x1234}, "data:brief")
    packet = Packet(message, 2 if protocol.shape.address else None)  # type: ignore[arg-type]
    assert packet.encode() == bytes.fromhex(raw)
    assert protocol.decode(bytes.fromhex(raw)) == packet


addresses = st.integers(0, 0xFF)
messages: st.SearchStrategy[tuple[str, str, dict[str, Any], int]] = st.one_of(
    st.just(("STOP", "header", {}, 0)),
    st.just(("STATE", "header", {}, 0)),
    st.builds(lambda bits: ("STATE", "data:brief", {"bits": bits}, 5), st.integers(0, 0xFFFF)),
    st.builds(
        lambda bits, label: ("STATE", "data:full", {"bits": bits, "label": label}, 24),
        st.integers(0, 0xFFFF),
        st.text(st.characters(max_codepoint=0xFF), max_size=6).filter(
            lambda text: not text.endswith("\0")
        ),
    ),
    st.builds(
        lambda angle, speed, reserved: (
            "SET_ANGLE", "data", {"angle": angle, "speed": speed, "reserved": reserved}, 26
        ),
        st.integers(-180_000, 180_000), st.integers(0, 0xFFFF), st.integers(0, 0xFF),
    ),
    st.builds(lambda page: ("PAGE", "data", {"page": page}, 0), st.binary(min_size=32, max_size=32)),
)  # fmt: skip


@given(st.sampled_from(sorted(SHAPES)), messages, addresses, st.binary(max_size=26))
def test_any_message_survives_a_round_trip(
    shape: str, said: tuple[str, str, dict[str, Any], int], address: int, extra: bytes
) -> None:
    protocol = PROTOCOLS[shape]
    name, form, fields, room = said  # room: bytes beyond the layout, before the next layout
    message: Any = protocol.build(name, fields, form)
    packet = Packet(message, address if protocol.shape.address else None, extra[:room])
    raw = packet.encode()
    assert protocol.decode(raw) == packet
    assert protocol.decode(bytearray(raw)).encode() == raw
    assert protocol.framer().feed(raw)[0].packet == packet  # type: ignore[attr-defined]


@given(st.sampled_from(sorted(SHAPES)), st.binary(max_size=20), st.booleans())
def test_any_bytes_decode_or_raise(shape: str, raw: bytes, begins: bool) -> None:
    protocol = PROTOCOLS[shape]
    raw = protocol.shape.start + raw if begins else raw
    events = protocol.framer().feed(raw)
    if events and isinstance(events[0], PacketReceived) and events[0].raw == raw:
        assert protocol.decode(raw).encode() == raw
        return
    with pytest.raises(CodecError) as refused:
        protocol.decode(raw)
    assert refused.value.at
    assert refused.value.at.stop <= len(raw) + 1


@pytest.mark.parametrize(
    ("raw", "error", "at", "said"),
    [
        (b"", TruncatedError, range(1), "at least 8 bytes, not 0"),
        (MOVE[:1], TruncatedError, range(1, 2), "at least 8 bytes, not 1"),
        (MOVE[:7], TruncatedError, range(7, 8), "at least 8 bytes, not 7"),
        (b"\xab" + MOVE[1:], DamagedError, range(1), "begins with AA 55, but byte 0 is AB"),
        (b"\xaa\x54", DamagedError, range(1, 2), "byte 1 is 54"),
        (MOVE[:-1], TruncatedError, range(2, 3), "so the packet has 14 bytes, but"),
        (MOVE + MOVE[:3], TrailingBytesError, range(14, 17), "ends before byte 14; found 3 more bytes"),
        (MOVE[:2] + b"\x01" + MOVE[3:], BadLengthError, range(2, 3), "byte 2 contains the length 1, but"),
        (MOVE[:2] + b"\x23" + MOVE[3:], BadLengthError, range(2, 3), "a payload of 33 bytes; the maximum"),
        (MOVE[:-1] + b"\x0a", DamagedError, range(13, 14), "ends with 0D, but byte 13 is 0A"),
        (MOVE[:5] + b"\xa1" + MOVE[6:], DamagedError, range(11, 13), "the check of length, address, id"),
        (with_check(b"\xaa\x55\x02\x07\x63\0\0\x0d"), UnknownMessageError, range(4, 5), "the id 0x63"),
        (with_check(MOVE[:2] + b"\x07" + MOVE[3:10] + MOVE[11:]), BadLengthError, range(2, 3),
         "SET_ANGLE: byte 2 leaves 5 bytes for its payload, which has 6"),
        (with_check(MOVE[:2] + b"\x03\x07\x03\x00\0\0\x0d"), BadLengthError, range(2, 3),
         "leaves 1 byte for its payload, which has 0 or 2 or 8"),
    ],
)  # fmt: skip
def test_errors_and_their_positions(
    raw: bytes, error: type[CodecError], at: range, said: str
) -> None:
    with pytest.raises(error, match=said) as refused:
        PROTOCOL.decode(raw)
    assert refused.value.at == at


@pytest.mark.parametrize(
    ("raw", "error"),
    [
        ("AA 05 02 000000000000", TrailingBytesError),
        ("AA 07 02 000000000000", TruncatedError),
        ("AA 06 02 000000000000 00", TrailingBytesError),
        ("AA 06 02 0000000000", TruncatedError),
        ("AA 21 0D", BadLengthError),
    ],
)
def test_wrong_lengths_without_a_check(raw: str, error: type[CodecError]) -> None:
    with pytest.raises(error):
        PROTOCOLS["bare"].decode(bytes.fromhex(raw))


def test_the_error_of_a_damaged_packet_contains_the_right_check() -> None:
    good = Packet(Stop(), 7).encode()
    with pytest.raises(DamagedError) as refused:
        PROTOCOL.decode(good[:3] + b"\x08" + good[4:])
    came = good[5:7].hex(" ").upper()
    wanted = with_check(good[:3] + b"\x08" + good[4:])[5:7].hex(" ").upper()
    assert str(refused.value) == (
        f"bytes 5 and 6 are {came}, the check of length, address, id and payload; computed "
        f"from the received bytes it is {wanted}"
    )
    assert refused.value.code == "bad_value"


def test_only_bytes_are_decoded() -> None:
    with pytest.raises(BadValueError, match=r"use bytes\.fromhex to convert hex text"):
        PROTOCOL.decode("AA55")  # type: ignore[arg-type]


# Packets


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda: Packet(Stop()), BadValueError, "address must be an integer from 0 to 0xff, not None"),
        (lambda: Packet(Stop(), True), BadValueError, "not True"),
        (lambda: Packet(Stop(), "7"), BadValueError, "not '7'"),
        (lambda: Packet(Stop(), 256), OutOfRangeError, "address must be 0 to 0xff, not 256"),
        (lambda: Packet(Stop(), -1), OutOfRangeError, "not -1"),
        (lambda: Packet(Stop(), 1, b"x"), BadValueError, "STOP has no payload to add extra bytes to"),
        (lambda: Packet(StateBrief(1), 1, "00"), BadValueError, "extra must be bytes"),
        (lambda: Packet("STOP", 1), BadValueError, "carries a message of its protocol, not 'STOP'"),
        (lambda: Packet(PROTOCOLS["bare"].message_class("STOP")(), 7), BadValueError, "have no address"),
        (lambda: Packet(SetAngle(0, 0), 1, bytes(27)).encode(), OutOfRangeError, "at most 32 bytes, not 33"),
    ],
)  # fmt: skip
def test_invalid_packets(make: Callable[[], object], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        make()


def test_the_shape_sets_the_size_of_an_address() -> None:
    stop: Any = PROTOCOLS["odd"].message_class("STOP")
    assert Packet(stop(), 0xFFFF).address == 0xFFFF
    with pytest.raises(OutOfRangeError, match="0 to 0xffff"):
        Packet(stop(), 0x10000)


def test_packets_are_values() -> None:
    packet = Packet(SetAngle(-5, 1), 7, bytearray(b"x"))
    assert packet.extra == b"x"
    assert repr(packet) == (
        "Packet(SetAngle(angle=-5, speed=1, reserved=0), address=0x07, extra=b'x')"
    )
    assert packet == Packet(SetAngle(-5, 1), 7, b"x") == copy.copy(packet)
    assert hash(packet) == hash(Packet(SetAngle(-5, 1), 7, b"x"))
    assert packet != Packet(SetAngle(-5, 1), 8, b"x")
    with pytest.raises(AttributeError, match="Packet is immutable; make a new one to change extra"):
        packet.extra = b""
    match packet:
        case Packet(SetAngle(angle, speed), address):
            assert (angle, speed, address) == (-5, 1, 7)
        case _:
            pytest.fail("it does not match")


# Messages by name


def test_messages_by_name() -> None:
    assert PROTOCOL.message_class("SET_ANGLE") is SetAngle
    assert PROTOCOL.message_class("STATE", "header") is State
    assert PROTOCOL.message_class("STATE", "data:full") is StateFull
    assert PROTOCOL.build("SET_ANGLE", {"angle": 1, "speed": 2}) == SetAngle(1, 2)
    for call, error in (
        (lambda: PROTOCOL.message_class("STATE"), BadLengthError),
        (lambda: PROTOCOL.message_class("SET_ANGEL"), UnknownMessageError),
        (lambda: PROTOCOL.message_class("HOME"), UnsupportedError),
        (lambda: PROTOCOL.build("SET_ANGLE", {"angle": 1}), MissingFieldError),
        (lambda: PROTOCOL.build("STOP", {"angle": 1}), UnknownFieldError),
        (lambda: PROTOCOL.build("SET_ANGLE", {"angle": 180_001, "speed": 2}), OutOfRangeError),
    ):
        with pytest.raises(error):
            call()


def test_a_class_belongs_to_one_shape() -> None:
    with pytest.raises(ValueError, match="Stop belongs to a protocol with another shape"):
        PacketProtocol("other", "Other", "other", [Stop], SHAPES["small"], {})
    assert PacketProtocol("same", "Same", "same", [Stop], USUAL, {}).decode(
        Packet(Stop(), 1).encode()
    ) == Packet(Stop(), 1)


def made(name: str, id: int, length: int) -> type[PacketMessage]:
    layout = Layout(name, id, Direction.BOTH, "data" if length else "header", (), length)
    return type(name, (PacketMessage,), {"__slots__": (), "layout": layout})


@pytest.mark.parametrize(
    ("classes", "said"),
    [
        ([made("A", 0x100, 0)], "A: the id 0x100 does not fit into a packet"),
        ([made("A", 1, 33)], "A: a payload has at most 32 bytes, not 33"),
        ([made("A", 1, 0), made("B", 1, 2)], "B and A have the same id 0x01"),
        ([made("A", 1, 2), made("A", 1, 2)], "A has two layouts of 2 bytes"),
    ],
)
def test_messages_that_packets_cannot_hold(classes: list[type[PacketMessage]], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        PacketProtocol("other", "Other", "other", classes, USUAL, {})


# Shapes


def shape(**changes: Any) -> Shape:
    parts: dict[str, Any] = {
        "order": ("start", "length", "id", "payload", "check"), "start": b"\x02", "length": 1,
        "counts": ("payload",), "id": 1, "maximum": 32, "check": Xor(), "covers": ("payload",),
    }  # fmt: skip
    return Shape(**(parts | changes))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"start": b""}, "begins with at least one byte"),
        ({"order": ("length", "start", "id", "payload", "check")}, "start must come first, not length"),
        ({"order": ("start", "id", "payload", "length", "check")}, "length must come before the payload"),
        ({"order": ("start", "length", "payload", "id", "check")}, "id must come before the payload"),
        ({"order": ("start", "length", "id", "check", "payload")}, "check must come after the payload"),
        ({"order": ("start", "length", "id", "payload", "end", "check"), "end": b"\3"}, "end must come last"),
        ({"order": ("start", "length", "id", "id", "payload", "check")}, "id is in the order twice"),
        ({"order": ("start", "length", "id", "payload", "check", "crc")}, "no part crc"),
        ({"order": ("start", "length", "id", "payload", "check", "end")}, "end is in the order but"),
        ({"order": ("start", "length", "address", "id", "payload", "check")}, "address is in the order but"),
        ({"order": ("start", "length", "id", "check")}, "payload is missing from the order"),
        ({"order": ()}, "is missing from the order"),
        ({"order": ("start", "length", "id", "payload")}, "check is missing from the order"),
        ({"end": b"\3"}, "end is missing from the order"),
        ({"address": 1}, "address is missing from the order"),
        ({"length": 0}, "length has 1 to 4 bytes, not 0"),
        ({"id": 5}, "id has 1 to 4 bytes, not 5"),
        ({"address": 9}, "address has 0 to 4 bytes, not 9"),
        ({"maximum": 256}, "counts to 255; a payload of 256 bytes makes it 256"),
        ({"maximum": 255, "counts": ("payload", "id")}, "makes it 256"),
        ({"maximum": -1}, "a payload of -1 bytes"),
        ({"counts": ("id",)}, "the length must count the payload"),
        ({"counts": ("payload", "end")}, "the length counts end, which is not in the order"),
        ({"counts": ("payload", "payload")}, "the length counts payload twice"),
        ({"covers": ()}, "check and covers must be given together"),
        ({"order": ("start", "length", "id", "payload"), "check": None}, "covers must be given together"),
        ({"covers": ("payload", "check")}, "cannot cover the check"),
        ({"covers": ("address",)}, "the check covers address, which is not in the order"),
        ({"order": ("start", "length", "id", "payload", "check", "end"), "end": b"\3",
          "covers": ("end",)}, "cannot cover the end"),
    ],
)  # fmt: skip
def test_invalid_shapes(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        shape(**changes)


def test_shapes_are_values() -> None:
    for one in SHAPES.values():
        assert pickle.loads(pickle.dumps(one)) == one == copy.deepcopy(one)
        assert hash(copy.copy(one)) == hash(one)
    assert len(set(SHAPES.values())) == len(SHAPES)
    assert shape() != shape(check=Sum(1)) != shape(check=Crc(1, 7, 0, False, 0))
    assert repr(USUAL) == "<Shape start length address id payload check end>"
    with pytest.raises(AttributeError, match="Shape is immutable"):
        USUAL.maximum = 1


def test_offsets_of_the_parts() -> None:
    places = [USUAL.place(part, 6) for part in USUAL.order]
    assert places == [
        range(2), range(2, 3), range(3, 4), range(4, 5), range(5, 11), range(11, 13), range(13, 14)
    ]  # fmt: skip


def test_a_page_fills_a_packet() -> None:
    assert PROTOCOL.decode(Packet(Page(bytes(32)), 0).encode()).message == Page(bytes(32))

"""The framing rule of packets, rule by rule, and properties that hold for any bytes."""

from __future__ import annotations

from itertools import combinations, pairwise
from random import Random

import framing_references as references
import pytest
from framing_references import KINDS, Piece, packet_reference
from hypothesis import given
from hypothesis import strategies as st

from invented_packets import PROTOCOL, SHAPES, SetAngle, Stop, protocol_of
from stagewire.errors import BadValueError
from stagewire.framing import BadPacketLength, Event, Garbage, PacketReceived, UnknownPacket
from stagewire.protocols import Packet, PacketProtocol, Shape

LENGTHS = {0x01: {0}, 0x02: {6}, 0x03: {0, 2, 8}, 0x0D: {32}}
PROTOCOLS = {name: protocol_of(shape) for name, shape in SHAPES.items()}
shapes = pytest.mark.parametrize("shape", SHAPES)


def packet(id: int, payload: bytes = b"", address: int = 7, shape: Shape = PROTOCOL.shape) -> bytes:
    return shape.pack(id, address, payload)


MOVE = packet(2, b"\xa0\x86\x01\x0a\x00\x00")
STOP = packet(1)
STATE = packet(3, b"\x01\x02")


def received(raw: bytes) -> Event:
    return PacketReceived(raw, PROTOCOL.decode)


def frame(stream: bytes) -> list[Event]:
    """Frame a stream and check that no byte was lost."""
    framer = PROTOCOL.framer()
    events = framer.feed(stream)
    assert b"".join(event.raw for event in events) + framer.pending == stream
    return events


def pieces(protocol: PacketProtocol, stream: bytes, sizes: list[int] | None = None) -> list[Piece]:
    """Frame a stream in chunks of the given sizes; return the events as the reference describes them."""
    chunks, position = [], 0
    for size in sizes or [len(stream)]:
        chunks.append(stream[position : position + size])
        position += size
    shape = protocol.shape
    return references.pieces(protocol.framer(), chunks, shape.least + shape.maximum)


# 1. A packet is found


def test_packets_are_returned_one_by_one() -> None:
    assert frame(MOVE + STOP + STATE) == [received(MOVE), received(STOP), received(STATE)]


def test_a_received_packet_is_decoded_on_demand() -> None:
    (event,) = frame(MOVE)
    assert isinstance(event, PacketReceived)
    assert event.packet == Packet(SetAngle(100_000, 10), 7)


def test_a_longer_payload_is_a_message_with_extra_bytes() -> None:
    raw = packet(2, bytes(9))
    assert frame(raw) == [received(raw)]
    raw = packet(3, bytes(7))  # one byte short of the longer layout
    assert frame(raw) == [received(raw)]


def test_an_unknown_id() -> None:
    raw = packet(9, b"\xaa\x55\x03")
    assert frame(raw + MOVE) == [UnknownPacket(raw), received(MOVE)]


@pytest.mark.parametrize(("id", "length"), [(2, 0), (2, 5), (3, 1), (1, 1), (0x0D, 31)])
def test_a_payload_that_fits_no_layout(id: int, length: int) -> None:
    raw = packet(id, bytes(length))
    assert frame(raw + MOVE) == [BadPacketLength(raw), received(MOVE)]


def test_the_longest_packet() -> None:
    raw = packet(0x0D, b"\xaa\x55" * 16)
    assert len(raw) == PROTOCOL.shape.least + 32
    assert frame(raw + raw + STOP) == [received(raw), received(raw), received(STOP)]


def test_packets_inside_a_payload_are_payload() -> None:
    raw = packet(0x0D, (STOP + STATE).ljust(32, b"\0"))
    assert frame(raw + STOP) == [received(raw), received(STOP)]


# 2. No packet is found


@pytest.mark.parametrize("at", range(len(MOVE)))
def test_a_damaged_packet_loses_only_itself(at: int) -> None:
    for bit in range(8):
        damaged = bytearray(MOVE)
        damaged[at] ^= 1 << bit
        stream = bytes(damaged) + STOP + MOVE + STATE * 8
        assert frame(stream) == [
            Garbage(bytes(damaged)), received(STOP), received(MOVE), *[received(STATE)] * 8
        ]  # fmt: skip


@pytest.mark.parametrize("number", [0, 1, 35, 0xFF])
def test_an_invalid_length_is_not_waited_for(number: int) -> None:
    impossible = b"\xaa\x55" + bytes((number,))
    assert frame(impossible) == [Garbage(impossible)]


def test_bytes_between_packets_are_garbage() -> None:
    assert frame(b"\x00\x55" + MOVE + b"\xaa\x0d" + STOP + b"\x55") == [
        Garbage(b"\x00\x55"), received(MOVE), Garbage(b"\xaa\x0d"), received(STOP), Garbage(b"\x55")
    ]  # fmt: skip


def test_start_bytes_that_begin_inside_others() -> None:
    protocol = PROTOCOLS["odd"]  # its start bytes are AA AA 55
    raw = packet(1, shape=protocol.shape)
    assert pieces(protocol, b"\xaa" + raw) == [Piece("garbage", b"\xaa"), Piece("message", raw)]


# 3. Missing bytes


@pytest.mark.parametrize("there", range(1, len(MOVE)))
def test_the_beginning_of_a_packet_waits(there: int) -> None:
    framer = PROTOCOL.framer()
    assert framer.feed(MOVE[:there]) == []
    assert framer.pending == MOVE[:there]
    assert framer.feed(MOVE[there:]) == [received(MOVE)]
    assert framer.pending == b""


def test_a_packet_whose_rest_does_not_arrive_is_given_up() -> None:
    framer = PROTOCOL.framer()
    longer = MOVE[:2] + b"\x20" + MOVE[3:]  # it declares 14 bytes more than it has
    assert framer.feed(longer + STOP) == []
    assert framer.abandon() == [Garbage(longer), received(STOP)]
    assert framer.pending == b""
    assert framer.abandon() == []
    assert framer.feed(MOVE[:9]) == []
    assert framer.abandon() == [Garbage(MOVE[:9])]
    assert framer.feed(MOVE) == [received(MOVE)]


def test_reset_discards_pending_bytes() -> None:
    framer = PROTOCOL.framer()
    framer.feed(MOVE[:5])
    framer.reset()
    assert framer.pending == b""
    assert framer.feed(STOP) == [received(STOP)]


def test_feeding_text_raises() -> None:
    framer = PROTOCOL.framer()
    assert framer.feed(memoryview(MOVE)) == framer.feed(bytearray(MOVE)) == [received(MOVE)]
    with pytest.raises(BadValueError, match="a framer takes bytes, not str"):
        framer.feed("aa55")  # type: ignore[arg-type]


# Any bytes, in any chunks, in any shape


def packets_of(shape: Shape, rng: Random, number: int) -> list[bytes]:
    """Return consecutive packets, known and unknown; some payloads contain start bytes."""
    made = []
    for _ in range(number):
        id, length = rng.choice(
            [(1, 0), (2, 6), (2, 6), (3, 0), (3, 2), (3, 8), (3, 5), (9, 3), (2, 1), (0x0D, 32)]
        )
        words = (shape.start, shape.end or b"\0", b"\0", rng.randbytes(1), rng.randbytes(3))
        payload = b"".join(rng.choice(words) for _ in range(length))[:length]
        made.append(shape.pack(id, rng.randrange(1 << 8 * shape.address), payload))
    return made


def damaged(stream: bytes, rng: Random) -> bytes:
    """Return a stream with one bit flipped, or one byte lost, doubled or inserted."""
    at = rng.randrange(len(stream))
    kind = rng.randrange(4)
    if kind == 0:
        return stream[:at] + bytes((stream[at] ^ 1 << rng.randrange(8),)) + stream[at + 1 :]
    if kind == 1:
        return stream[:at] + stream[at + 1 :]
    inserted = stream[at : at + 1] if kind == 2 else rng.randbytes(1)
    return stream[:at] + inserted + stream[at:]


def chunks(rng: Random, length: int) -> list[int]:
    edges = sorted({0, length, *(rng.randrange(length + 1) for _ in range(rng.randrange(8)))})
    return [stop - start for start, stop in pairwise(edges)] or [0]


@shapes
def test_the_framer_agrees_with_the_reference_on_damaged_streams(shape: str) -> None:
    protocol, rng = PROTOCOLS[shape], Random(shape)
    reference = packet_reference(protocol.shape, LENGTHS)
    seen: set[str] = set()
    for _ in range(800):
        stream = b"".join(packets_of(protocol.shape, rng, rng.randrange(1, 6)))
        for _ in range(rng.randrange(4)):
            stream = damaged(stream, rng)
        stream = stream[: rng.randrange(len(stream), len(stream) + 8)]
        expected = reference.read(stream)
        assert pieces(protocol, stream) == expected
        assert pieces(protocol, stream, chunks(rng, len(stream))) == expected
        assert pieces(protocol, stream, [1] * len(stream)) == expected
        seen |= {kind for kind, _ in expected}
    assert seen == {*KINDS.values(), "pending"}


@pytest.mark.parametrize("shape", ["usual", "ended", "odd"])
def test_a_damage_costs_few_packets(shape: str) -> None:
    protocol, rng = PROTOCOLS[shape], Random(shape)
    lost = invented = 0
    for _ in range(500):
        sent = packets_of(protocol.shape, rng, 6)
        stream = damaged(b"".join(sent), rng) + bytes(400)  # so that no packet is pending
        came = [piece.raw for piece in pieces(protocol, stream) if piece.kind != "garbage"]
        missing = list(sent)
        for raw in came:
            if raw in missing:
                missing.remove(raw)
            else:
                invented += 1
        lost = max(lost, len(missing))
    assert lost == 1
    assert not invented or shape != "usual"  # its check covers everything that could be mistaken


@given(st.sampled_from(sorted(SHAPES)), st.data())
def test_any_bytes_in_any_chunks(shape: str, data: st.DataObject) -> None:
    protocol = PROTOCOLS[shape]
    found = protocol.shape
    address = 1 if found.address else None
    words = st.one_of(
        st.sampled_from([found.start, found.start[:1], found.end, b"\0", b"\1", b"\6"]),
        st.binary(max_size=4),
        st.sampled_from([found.pack(2, address, bytes(6)), found.pack(1, address, b"")]),
    )
    stream = b"".join(data.draw(st.lists(words, max_size=12)))
    expected = packet_reference(found, LENGTHS).read(stream)
    assert pieces(protocol, stream) == expected
    sizes = data.draw(st.lists(st.integers(0, 9), min_size=1, max_size=20))
    assert pieces(protocol, stream, [*sizes, len(stream)]) == expected


@shapes
def test_every_split_of_a_stream(shape: str) -> None:
    protocol, rng = PROTOCOLS[shape], Random(shape)
    stream = damaged(b"".join(packets_of(protocol.shape, rng, 3)), rng) + protocol.shape.start
    stream = stream[-60:]
    expected = pieces(protocol, stream)
    for first, second in combinations(range(len(stream) + 1), 2):
        assert pieces(protocol, stream, [first, second - first, len(stream)]) == expected


@shapes
def test_abandoning_returns_whole_packets(shape: str) -> None:
    protocol, rng = PROTOCOLS[shape], Random(shape)
    for _ in range(300):
        stream = b"".join(packets_of(protocol.shape, rng, 3))
        stream = damaged(stream, rng)[: rng.randrange(len(stream) + 1)]
        framer = protocol.framer()
        events = framer.feed(stream)
        pending = framer.pending
        given_up = framer.abandon()
        assert b"".join(event.raw for event in given_up) == pending
        assert framer.pending == b""
        assert not pending or isinstance(given_up[0], Garbage)
        assert b"".join(event.raw for event in [*events, *given_up]) == stream


def test_the_work_for_hostile_bytes_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    protocol = PROTOCOLS["bare"]
    looked = 0
    is_whole = Shape.is_whole

    def counted(shape: Shape, raw: bytes) -> bool:
        nonlocal looked
        looked += len(raw)
        return is_whole(shape, raw) and False

    monkeypatch.setattr(Shape, "is_whole", counted)
    stream = b"\xaa\x20" * 2000  # every second byte may begin a longest packet
    framer = protocol.framer()
    for byte in stream:
        framer.feed(bytes((byte,)))
    longest = protocol.shape.least + protocol.shape.maximum
    assert 0 < looked <= len(stream) * longest


def test_stop_belongs_to_one_shape() -> None:
    other = PROTOCOLS["small"].message_class("STOP")
    assert Packet(other()).encode() == b"\x02\x00\x01\x03"
    assert Packet(Stop(), 7).encode() == STOP

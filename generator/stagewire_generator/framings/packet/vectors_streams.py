"""The bytes of packets, and streams of packets, complete, cut and damaged, with the events of a framer.

The parts of a packet and their order are data of its protocol. This is a slow and simple implementation of
the rule of the framer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from operator import xor

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.vectors.framing import (
    Piece,
    Scenario,
    cut,
    in_bytes,
    stream_answer,
    stream_case,
)
from stagewire_generator.targets.vectors.subject import Case, Subject
from stagewire_generator.targets.vectors.values import fields_from_bytes, greatest_but, shown


class Packets:
    """Packs the packets of one protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self._framing: Json = protocol.framing
        self.most: int = self._framing["maximum_length"]
        self.start = bytes(self._framing["start"])
        self.sizes: dict[str, int] = {
            part: self._framing[part]["size"] if part in self._framing else 0
            for part in ("length", "address", "id", "check")
        }
        self.sizes |= {part: len(self._framing.get(part, ())) for part in ("start", "end")}
        self.order: list[str] = self._framing["order"]
        self._counts: list[str] = self._framing["length"]["counts"]

    @property
    def counted(self) -> int:
        """The value of the length in a packet without payload."""
        return sum(self.sizes.get(part, 0) for part in self._counts)

    @property
    def least(self) -> int:
        """Length of a packet without payload in bytes."""
        return sum(self.sizes.values())

    @property
    def greatest_address(self) -> int:
        """The greatest address; 0 if packets have none."""
        return (1 << 8 * self.sizes["address"]) - 1

    def pack(self, id: int, address: int, payload: bytes, declared: int | None = None) -> bytes:
        """Return a packet; ``declared`` replaces its length."""
        length = self.counted + len(payload) if declared is None else declared
        parts = {
            "start": self.start,
            "length": self._number("length", length),
            "address": self._number("address", address),
            "id": self._number("id", id),
            "payload": payload,
            "end": bytes(self._framing.get("end", ())),
        }
        parts["check"] = self._check(parts)
        return b"".join([parts[part] for part in self.order])

    def place(self, part: str, payload: int) -> slice:
        """Return the place of a part in a packet with ``payload`` bytes of payload."""
        sizes = {**self.sizes, "payload": payload}
        at = sum(sizes[before] for before in self.order[: self.order.index(part)])
        return slice(at, at + sizes[part])

    def number(self, part: str, packet: bytes, payload: int) -> int:
        """Return the number in a part of a packet; 0 if packets have no such part."""
        return (
            int.from_bytes(packet[self.place(part, payload)], "little") if part in self.order else 0
        )

    def _number(self, part: str, number: int) -> bytes:
        return number.to_bytes(self.sizes[part], "little")

    def _check(self, parts: dict[str, bytes]) -> bytes:
        check = self._framing.get("check")
        if not check:
            return b""
        covered = b"".join([parts[part] for part in self.order if part in check["covers"]])
        return self._number("check", _METHODS[check["method"]](covered, check))


def _sum(data: bytes, check: Json) -> int:
    most: int = (1 << 8 * check["size"]) - 1
    total = {"none": sum(data), "ones": ~sum(data), "twos": -sum(data)}
    return total[check.get("complement", "none")] & most


def _xor(data: bytes, check: Json) -> int:
    return reduce(xor, data, 0)


def _crc(data: bytes, check: Json) -> int:
    """Compute a cyclic redundancy check bit by bit, with the parameters of the Rocksoft model."""
    width: int = 8 * check["size"]
    register: int = check.get("initial", 0)
    for byte in data:
        byte = _reflected(byte, 8) if check["reflected"] else byte
        for bit in range(7, -1, -1):
            high = register >> (width - 1) ^ byte >> bit & 1
            register = (register << 1) & ((1 << width) - 1) ^ (check["polynomial"] if high else 0)
    if check["reflected"]:
        register = _reflected(register, width)
    final: int = check.get("final", 0)
    return register ^ final


def _reflected(number: int, width: int) -> int:
    return int(f"{number:0{width}b}"[::-1], 2)


_METHODS = {"sum": _sum, "xor": _xor, "crc": _crc}


def unknown_id(protocol: Protocol) -> int | None:
    """Return an id that no message has; None if all ids are in use."""
    ids = {message.id for message in protocol.messages}
    return greatest_but(ids, protocol.framing["id"]["size"])


class PacketReader:
    """Reads the streams of one protocol; both ends of the line receive the same kind of packets."""

    def __init__(self, protocol: Protocol) -> None:
        self._packets = Packets(protocol)
        self._lengths = {
            message.id: {layout.length for layout in message.layouts}
            for message in protocol.messages
        }

    def read(self, stream: bytes) -> list[Piece]:
        """Return the pieces of a stream; adjacent garbage is joined."""
        return cut(stream, self._begins)

    def _begins(self, rest: bytes) -> tuple[str, int]:
        """Return the kind and the length of the piece at the start."""
        packets = self._packets
        if rest[: len(packets.start)] != packets.start[: len(rest)]:
            return "garbage", 1
        if len(rest) < packets.place("length", 0).stop:
            return "pending", len(rest)
        payload = packets.number("length", rest, 0) - packets.counted
        if not 0 <= payload <= packets.most:
            return "garbage", 1
        size = packets.least + payload
        if len(rest) < size:
            return "pending", len(rest)
        packet = rest[:size]
        id = packets.number("id", packet, payload)
        address = packets.number("address", packet, payload)
        if packet != packets.pack(id, address, packet[packets.place("payload", payload)]):
            return "garbage", 1
        if id not in self._lengths:
            return "unknown", size
        longest = max((n for n in self._lengths[id] if n <= payload), default=None)
        fits = longest is not None and (longest or not payload)
        return ("message" if fits else "bad_length"), size


def layout_stream(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the plain packet of a layout as a stream in two chunks."""
    expected = stream_answer(PacketReader(protocol).read(raw), lambda _: of.answer(of.plain))
    half = len(raw) // 2
    yield of.stream("plain", "", [raw[:half], raw[half:]], expected)


def stream_cases(
    protocol: Protocol, subjects: Sequence[Subject], raws: Sequence[bytes]
) -> Iterator[Case]:
    """Yield streams of plain packets and of damaged ones."""
    packets = Packets(protocol)
    reader, decode = PacketReader(protocol), _Decoder(packets, subjects)
    for scenario in _scenarios(protocol, packets, subjects, raws):
        expected = stream_answer(reader.read(b"".join(scenario[2])), decode)
        for end in ("host", "device", "none"):
            yield stream_case(f"stream/{end}", scenario, expected, end=end)


class _Decoder:
    """Decodes the packets of a stream."""

    def __init__(self, packets: Packets, subjects: Sequence[Subject]) -> None:
        self._packets = packets
        self._subjects: dict[int | None, list[Subject]] = {}
        for of in subjects:
            self._subjects.setdefault(of.message.id, []).append(of)

    def __call__(self, raw: bytes) -> Json:
        """Return the answer of a decoder to a packet."""
        packets = self._packets
        length = len(raw) - packets.least
        forms = self._subjects[packets.number("id", raw, length)]
        fitting = [of for of in forms if of.layout.length <= length]
        of = max(fitting, key=lambda of: of.layout.length)
        payload = raw[packets.place("payload", length)]
        says = {**of.says, "fields": shown(of.fields, fields_from_bytes(of.fields, payload))}
        if packets.sizes["address"]:
            says["address"] = packets.number("address", raw, length)
        extra = payload[of.layout.length :]
        return {**says, "extra": extra.hex()} if extra else says


def _scenarios(
    protocol: Protocol, packets: Packets, subjects: Sequence[Subject], raws: Sequence[bytes]
) -> Iterator[Scenario]:
    raw, bare = raws[0], raws[-1]  # the longest and the shortest
    yield "nothing", "no chunks", []
    yield "empty", "chunks without bytes", [b"", b""]
    yield "bytes", "one byte at a time", in_bytes(raw + bare)
    yield "every", "every message", [b"".join(raws)]
    yield "pending", "an incomplete second packet", [bare + raw[:-1]]
    yield "pending.start", "only the first byte of a second packet", [bare, raw[:1]]
    start = packets.start[:1]
    yield "start", "the first byte of a packet, then a packet", [start + raw]
    other = bytes((start[0] ^ 0xFF,))
    yield "garbage", "garbage before, between and after packets", [
        3 * other + raw + 2 * other + bare + other
    ]  # fmt: skip
    for at in range(len(raw)):
        about = f"a packet without its byte {at}, then four packets"
        yield f"lost.{at}", about, [raw[:at] + raw[at + 1 :] + 2 * (bare + raw)]
    for part in packets.order:
        place = packets.place(part, subjects[0].layout.length)
        if place.start < place.stop:
            at = place.start
            turned = raw[:at] + bytes((raw[at] ^ 1,)) + raw[at + 1 :]
            about = f"a flipped bit in the part {part}, then four packets"
            yield f"damaged.{part}", about, [turned + 2 * (bare + raw)]
    address = subjects[0].asked.get("address", 0)
    unknown = unknown_id(protocol)
    if unknown is not None:
        there = packets.pack(unknown, address, raw[:2])
        yield "unknown", "an unknown id, then a packet", [there + bare]
    id, length = subjects[0].message.id, subjects[0].layout.length
    payload = raw[packets.place("payload", length)]
    assert id is not None
    if payload:
        short = packets.pack(id, address, payload[:-1])
        yield "short", "a payload shorter than its layout, then a packet", [short + bare]
        if length < packets.most:
            longer = packets.pack(id, address, payload + b"\xa5")
            yield "extra", "a payload longer than its layout, then a packet", [longer + bare]

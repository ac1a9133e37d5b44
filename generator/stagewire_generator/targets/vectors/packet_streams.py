"""Streams of packets: what a framer makes of them, whole, cut and damaged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.contents import shown
from stagewire_generator.targets.vectors.packet_frame import Packets
from stagewire_generator.targets.vectors.packet_protocol import unknown_id
from stagewire_generator.targets.vectors.packet_reader import PacketReader
from stagewire_generator.targets.vectors.streams import (
    Scenario,
    in_bytes,
    stream_answer,
    stream_case,
)
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.wire import fields_from_bytes

__all__ = ["layout_stream", "stream_cases"]


def layout_stream(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the plain packet of a layout as a stream in two chunks."""
    expected = stream_answer(PacketReader(protocol).read(raw), lambda _: of.answer(of.plain))
    half = len(raw) // 2
    yield of.stream("plain", "", [raw[:half], raw[half:]], expected)


def stream_cases(
    protocol: Protocol, subjects: Sequence[Subject], raws: Sequence[bytes]
) -> Iterator[Case]:
    """Yield streams of plain packets, and of damaged ones."""
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
        """Return what a decoder says of a packet."""
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
    yield "nothing", "nothing at all", []
    yield "empty", "chunks without bytes", [b"", b""]
    yield "bytes", "one byte at a time", in_bytes(raw + bare)
    yield "every", "every message", [b"".join(raws)]
    yield "pending", "a second packet that is not all there", [bare + raw[:-1]]
    yield "pending.start", "of a second packet only the first byte", [bare, raw[:1]]
    start = packets.start[:1]
    yield "start", "the first byte of a packet, then a packet", [start + raw]
    other = bytes((start[0] ^ 0xFF,))
    yield "garbage", "garbage before, between and behind packets", [
        3 * other + raw + 2 * other + bare + other
    ]  # fmt: skip
    for at in range(len(raw)):
        about = f"a packet that lost its byte {at}, then four"
        yield f"lost.{at}", about, [raw[:at] + raw[at + 1 :] + 2 * (bare + raw)]
    for part in packets.order:
        place = packets.place(part, subjects[0].layout.length)
        if place.start < place.stop:
            at = place.start
            turned = raw[:at] + bytes((raw[at] ^ 1,)) + raw[at + 1 :]
            about = f"a bit of its {part} is another, then four packets"
            yield f"damaged.{part}", about, [turned + 2 * (bare + raw)]
    address = subjects[0].asked.get("address", 0)
    unknown = unknown_id(protocol)
    if unknown is not None:
        there = packets.pack(unknown, address, raw[:2])
        yield "unknown", "an id that no message has, then a packet", [there + bare]
    id, length = subjects[0].message.id, subjects[0].layout.length
    payload = raw[packets.place("payload", length)]
    assert id is not None
    if payload:
        short = packets.pack(id, address, payload[:-1])
        yield "short", "a payload shorter than its layout, then a packet", [short + bare]
        if length < packets.most:
            longer = packets.pack(id, address, payload + b"\xa5")
            yield "extra", "a payload longer than its layout, then a packet", [longer + bare]

"""Cases of packets.

Properties that all packets share are checked once: addresses, damage, lengths and unknown ids.
"""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.framings.packet.vectors_streams import (
    Packets,
    layout_stream,
    stream_cases,
    unknown_id,
)
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.subject import (
    LEFT_OUT,
    Case,
    Subject,
    make_case,
    no_id_case,
)
from stagewire_generator.targets.vectors.values import fields_to_bytes


def protocol_cases(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the cases that all packets share, checked with the plain packet of one layout."""
    packets = Packets(protocol)
    request = {"op": "encode", "message": "NO_SUCH_MESSAGE"} | _address(of)
    about = "an unknown name"
    yield make_case("frame/encode/message", about, request, "unknown_message")
    unknown = unknown_id(protocol)
    if unknown is not None:
        there = packets.pack(unknown, of.asked.get("address", 0), b"")
        yield of.decode("id.unknown", "an unknown id", there, "unknown_message")
    about = "an address of another protocol"
    yield of.encode("dest", about, "bad_request", dest=1)
    yield of.decode("context", "a context", raw, "bad_request", context={"status": "dc"})
    yield from _addresses(packets, of, raw)
    yield from _damaged(packets, of, raw)
    yield from _lengths(packets, of, raw)


def _address(of: Subject) -> dict[str, int]:
    return {key: of.asked[key] for key in ("address",) if key in of.asked}


def _addresses(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    if not packets.sizes["address"]:
        about = "an address, although packets have none"
        yield of.encode("address", about, "bad_request", address=1)
        return
    most = packets.greatest_address
    payload = raw[packets.place("payload", of.layout.length)]
    assert of.message.id is not None
    for name, address in (("least", 0), ("greatest", most)):
        there = packets.pack(of.message.id, address, payload)
        about = f"the {name} address"
        yield of.encode(f"address.{name}", about, there, address=address)
        yield of.decode(f"address.{name}", about, there, of.answer(of.plain, address=address))
    for name, about, value, code in (
        ("below", "is negative", -1, "out_of_range"),
        ("above", "is too great", most + 1, "out_of_range"),
        ("missing", "is missing", LEFT_OUT, "missing_field"),
        ("text", "is a string", "1", "bad_value"),
        ("true", "is a boolean", True, "bad_value"),
    ):
        yield of.encode(f"address.{name}", f"the address {about}", code, address=value)


def _damaged(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield packets with a flipped bit in their constant bytes, check or payload."""
    for part in ("start", "check", "end"):
        if part in packets.order:
            place = packets.place(part, of.layout.length)
            for at in range(place.start, place.stop):
                there = _flipped(raw, at)
                name = f"{part}.{at - place.start}"
                yield of.decode(name, f"a flipped bit in the part {part}", there, "bad_value")
    if "check" in packets.order and of.layout.length:
        at = packets.place("payload", of.layout.length).start
        if _covered(packets, of, raw, at):
            about = "a flipped bit in the payload"
            yield of.decode("payload", about, _flipped(raw, at), "bad_value")


def _covered(packets: Packets, of: Subject, raw: bytes, at: int) -> bool:
    """Whether the check of a packet changes if a bit of its payload is flipped."""
    assert of.message.id is not None
    payload = _flipped(raw, at)[packets.place("payload", of.layout.length)]
    there = packets.pack(of.message.id, of.asked.get("address", 0), payload)
    check = packets.place("check", of.layout.length)
    return there[check] != raw[check]


def _flipped(raw: bytes, at: int) -> bytes:
    return raw[:at] + bytes((raw[at] ^ 1,)) + raw[at + 1 :]


def _lengths(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield impossible lengths, and the longest payload."""
    assert of.message.id is not None
    address = of.asked.get("address", 0)
    payload = raw[packets.place("payload", of.layout.length)]
    if packets.counted:
        there = packets.pack(of.message.id, address, payload, declared=packets.counted - 1)
        about = "a length less than that of a packet without payload"
        yield of.decode("length.below", about, there, "bad_length")
    above = packets.counted + packets.most + 1
    if above < 1 << 8 * packets.sizes["length"]:
        there = packets.pack(of.message.id, address, payload, declared=above)
        yield of.decode("length.above", "a length that is too great", there, "bad_length")
    room = packets.most - of.layout.length
    if of.layout.length:
        about = "a payload that is too long"
        yield of.encode("extra.above", about, "out_of_range", extra="a5" * (room + 1))
        if room and of.layout.length == max(layout.length for layout in of.message.layouts):
            longest = packets.pack(of.message.id, address, payload + b"\xa5" * room)
            about = "the longest payload"
            yield of.encode("extra.most", about, longest, extra="a5" * room)
            yield of.decode("extra.most", about, longest, of.answer(of.plain, extra="a5" * room))


class PacketFraming(Framing):
    """Packets whose parts and their order are data of the protocol."""

    def __init__(self, protocol: Protocol) -> None:
        super().__init__(protocol)
        self._packets = Packets(protocol)
        # All bytes of the address differ, so that a wrong order is detected.
        self._address = 0x04030201 & self._packets.greatest_address

    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""
        envelope = {"address": self._address} if self._packets.sizes["address"] else {}
        return Subject(message, layout, layout.fields, envelope, {}, envelope)

    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a packet with these values and extra bytes."""
        return self._pack(of.message, fields_to_bytes(of.fields, held) + extra)

    def _pack(self, message: Message, payload: bytes) -> bytes:
        assert message.id is not None
        return self._packets.pack(message.id, self._address, payload)

    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield packets that are incomplete, too long, or have a payload of another length."""
        raw = self.frame(of, of.plain.held)
        for end in sorted({0, 1, self._packets.least - 1, len(raw) // 2, len(raw) - 1}):
            yield of.decode(f"cut.{end}", "", raw[:end], "truncated")
        yield of.decode("trailing", "", raw + b"\0", "trailing")
        lengths = {layout.length for layout in of.message.layouts}
        payload = fields_to_bytes(of.fields, of.plain.held)
        if len(payload) == min(lengths - {0}, default=None) and len(payload) - 1 not in lengths:
            short = self._pack(of.message, payload[:-1])
            about = "a payload one byte shorter than its layout"
            yield of.decode("short", about, short, "bad_length")
        if not payload:
            about = "an extra byte without a payload"
            yield of.encode("extra", about, "bad_value", extra="a5")
            if 1 not in lengths:
                yield of.decode("extra", about, self._pack(of.message, b"\xa5"), "bad_length")
        elif len(payload) < self._packets.most and len(payload) + 1 not in lengths:
            longer = self.frame(of, of.plain.held, b"\xa5")
            about = "a payload one byte longer than its layout"
            yield of.encode("extra", about, longer, extra="a5")
            yield of.decode("extra", about, longer, of.answer(of.plain, extra="a5"))
        yield from layout_stream(self.protocol, of, raw)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield missing and wrong forms, and a message without an id."""
        if message.id is None:
            yield no_id_case(message)
            return
        of = self.subject(message, message.layouts[0])
        yield of.encode("form.unknown", "an unknown form", "bad_length", form="no_such_form")
        expected = self.frame(of, of.plain.held) if len(message.layouts) == 1 else "bad_length"
        yield of.encode("form.left_out", "no form", expected, form=LEFT_OUT)

    def of_protocol(self) -> Iterator[Case]:
        """Yield addresses, damaged packets, unknown messages and streams."""
        subjects = [
            self.subject(message, layout)
            for message in self.protocol.messages
            if message.id is not None
            for layout in message.layouts
        ]
        # The longest packet first: it can be damaged in most ways.
        subjects.sort(key=lambda of: -of.layout.length)
        raws = [self.frame(of, of.plain.held) for of in subjects]
        if subjects:
            yield from protocol_cases(self.protocol, subjects[0], raws[0])
            yield from stream_cases(self.protocol, subjects, raws)

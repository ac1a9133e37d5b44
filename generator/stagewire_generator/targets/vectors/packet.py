"""Packets: start bytes, a length, an id, a payload, and perhaps an address, a check and end bytes."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.packet_frame import Packets
from stagewire_generator.targets.vectors.packet_protocol import protocol_cases
from stagewire_generator.targets.vectors.packet_streams import layout_stream, stream_cases
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject, make_case
from stagewire_generator.targets.vectors.wire import fields_to_bytes

__all__ = ["PacketFraming"]


class PacketFraming(Framing):
    """Parts in an order of their own."""

    def __init__(self, protocol: Protocol) -> None:
        super().__init__(protocol)
        self._packets = Packets(protocol)
        # Every byte of an address is another, so that their order shows.
        self._address = 0x04030201 & self._packets.greatest_address

    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""
        envelope = {"address": self._address} if self._packets.sizes["address"] else {}
        return Subject(message, layout, layout.fields, envelope, {}, envelope)

    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a packet that holds values, and bytes beyond the layout."""
        return self._pack(of.message, fields_to_bytes(of.fields, held) + extra)

    def _pack(self, message: Message, payload: bytes) -> bytes:
        assert message.id is not None
        return self._packets.pack(message.id, self._address, payload)

    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield packets that are cut, too long, or carry another payload than the layout."""
        raw = self.frame(of, of.plain.held)
        for end in sorted({0, 1, self._packets.least - 1, len(raw) // 2, len(raw) - 1}):
            yield of.decode(f"cut.{end}", "", raw[:end], "truncated")
        yield of.decode("trailing", "", raw + b"\0", "trailing")
        lengths = {layout.length for layout in of.message.layouts}
        payload = fields_to_bytes(of.fields, of.plain.held)
        if len(payload) == min(lengths - {0}, default=None) and len(payload) - 1 not in lengths:
            short = self._pack(of.message, payload[:-1])
            about = "a payload that is a byte shorter than its layout"
            yield of.decode("short", about, short, "bad_length")
        if not payload:
            about = "a byte beyond a layout without payload"
            yield of.encode("extra", about, "bad_value", extra="a5")
            if 1 not in lengths:
                yield of.decode("extra", about, self._pack(of.message, b"\xa5"), "bad_length")
        elif len(payload) < self._packets.most and len(payload) + 1 not in lengths:
            longer = self.frame(of, of.plain.held, b"\xa5")
            about = "a payload that is a byte longer than its layout"
            yield of.encode("extra", about, longer, extra="a5")
            yield of.decode("extra", about, longer, of.answer(of.plain, extra="a5"))
        yield from layout_stream(self.protocol, of, raw)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield forms that are left out or wrong, and a message without an id."""
        if message.id is None:
            request = {"op": "encode", "message": message.name, "fields": {}}
            about = "a message without an id"
            yield make_case(f"{message.name}/encode/no_id", about, request, "unsupported")
            return
        of = self.subject(message, message.layouts[0])
        yield of.encode("form.unknown", "a form that it has not", "bad_length", form="no_such_form")
        expected = self.frame(of, of.plain.held) if len(message.layouts) == 1 else "bad_length"
        yield of.encode("form.left_out", "its form left out", expected, form=LEFT_OUT)

    def of_protocol(self) -> Iterator[Case]:
        """Yield addresses, damaged packets, unknown messages and streams."""
        subjects = [
            self.subject(message, layout)
            for message in self.protocol.messages
            if message.id is not None
            for layout in message.layouts
        ]
        # What is longest can be damaged in most ways.
        subjects.sort(key=lambda of: -of.layout.length)
        raws = [self.frame(of, of.plain.held) for of in subjects]
        if subjects:
            yield from protocol_cases(self.protocol, subjects[0], raws[0])
            yield from stream_cases(self.protocol, subjects, raws)

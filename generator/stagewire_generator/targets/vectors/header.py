"""Frames that begin with a header: id, two parameters or the length of a packet, two addresses."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Field, Format, Json, Layout, Message
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.header_context import context_cases, undecided_cases
from stagewire_generator.targets.vectors.header_frame import (
    MOST,
    SIZE,
    addresses,
    data_frame,
    header_frame,
    id_of,
)
from stagewire_generator.targets.vectors.header_protocol import protocol_cases
from stagewire_generator.targets.vectors.header_streams import layout_stream, stream_cases
from stagewire_generator.targets.vectors.header_undocumented import undocumented_cases
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject, make_case
from stagewire_generator.targets.vectors.wire import fields_to_bytes

__all__ = ["HeaderFraming"]

_BYTE = Format("byte", 1, False, "integer")


class HeaderFraming(Framing):
    """A header of six bytes, and perhaps a packet."""

    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""
        dest, source = addresses(self.protocol, message)
        envelope = {"dest": dest, "source": source}
        reading = {"context": dict(layout.when)} if layout.when else {}
        return Subject(message, layout, _fields(layout), envelope, reading, envelope)

    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a frame that holds values, and bytes beyond the layout."""
        content = fields_to_bytes(of.fields, held)
        dest, source = of.asked["dest"], of.asked["source"]
        if of.layout.form == "header":
            param1, param2 = content
            return header_frame(id_of(of.message), param1, param2, dest, source)
        return data_frame(id_of(of.message), content + extra, dest, source)

    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield frames that are too short or too long, and what is wrong with an address or a context."""
        raw = self.frame(of, of.plain.held)
        if of.layout.form == "header":
            yield of.decode("cut", "", raw[:-1], "truncated")
            yield of.decode("trailing", "", raw + b"\0", "trailing")
            about = "bytes beyond a layout without packet"
            yield of.encode("extra", about, "bad_value", extra="00")
        else:
            yield from self._lengths(of, raw)
        about = "an address with the bit that announces a packet"
        yield of.encode("dest.above", about, "out_of_range", dest=0x80)
        yield from context_cases(self.protocol, of, raw)
        yield from layout_stream(self.protocol, of, raw)

    def _lengths(self, of: Subject, raw: bytes) -> Iterator[Case]:
        first = of.fields[0].format.size if of.fields else 1
        cuts = {
            "cut.header": ("in the middle of its header", SIZE // 2),
            "cut.packet": ("without its packet", SIZE),
            "cut.field": ("without the last byte of its first field", SIZE + first - 1),
            "cut": ("", len(raw) - 1),
        }
        ends = set()
        for name, (about, end) in cuts.items():
            if end not in ends:
                ends.add(end)
                yield of.decode(name, about, raw[:end], "truncated")
        yield of.decode("trailing", "", raw + b"\0", "trailing")
        lengths = _lengths(of.message)
        dest, source = of.asked["dest"], of.asked["source"]
        if of.layout.length == min(lengths):
            short = data_frame(id_of(of.message), raw[SIZE:-1], dest, source)
            about = "a packet that is a byte shorter than every layout"
            yield of.decode("short", about, short, "bad_length")
        if of.layout.length < MOST and of.layout.length + 1 not in lengths:
            longer = self.frame(of, of.plain.held, b"\xa5")
            answer = of.answer(of.plain, extra="a5")
            about = "a packet that is a byte longer than its layout"
            yield of.encode("extra", about, longer, extra="a5")
            yield of.decode("extra", about, longer, answer)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield forms that are left out, wrong or undecided, and a message without a layout."""
        if message.id is None:
            request = {"op": "encode", "message": message.name, "fields": {}}
            about = "a message without an id"
            yield make_case(f"{message.name}/encode/no_id", about, request, "unsupported")
            return
        if not message.documented:
            yield from undocumented_cases(self.protocol, message)
            return
        of = self.subject(message, message.layouts[0])
        raw = self.frame(of, of.plain.held)
        about = "a form that it has not"
        yield of.encode("form.unknown", about, "bad_length", form="no_such_form")
        about = "its form left out"
        expected = raw if len(message.layouts) == 1 else "bad_length"
        yield of.encode("form.left_out", about, expected, form=LEFT_OUT)
        dest, source = of.asked["dest"], of.asked["source"]
        if not any(layout.form == "header" for layout in message.layouts):
            bare = header_frame(message.id, 0, 0, dest, source)
            about = "a header without the packet that it has"
            yield of.decode("header_alone", about, bare, "bad_length")
        if not _lengths(message):
            for length in (0, 2):
                packet = data_frame(message.id, bytes(length), dest, source)
                about = f"a packet of {length} bytes where none belongs"
                yield of.decode(f"packet_of_{length}", about, packet, "bad_length")
        yield from undecided_cases(self, message)

    def of_protocol(self) -> Iterator[Case]:
        """Yield addresses, lengths, unknown messages and streams."""
        documented = [message for message in self.protocol.messages if message.layouts]
        subjects = [self.subject(m, layout) for m in documented for layout in m.layouts]
        yield from protocol_cases(self, subjects)
        yield from stream_cases(self, subjects)


def _fields(layout: Layout) -> tuple[Field, ...]:
    """Return what an encoder can be given; both parameters of a header, with a name or without."""
    if layout.form != "header":
        return layout.fields
    named = (layout.param1, layout.param2)
    unnamed = (
        Field(
            name=f"param{number}",
            offset=1 + number,
            format=_BYTE,
            role="reserved",
            minimum=_BYTE.minimum,
            maximum=_BYTE.maximum,
            page=0,
            place=layout.place,
        )
        for number in (1, 2)
    )
    return tuple(field or other for field, other in zip(named, unnamed, strict=True))


def _lengths(message: Message) -> set[int]:
    return {layout.length for layout in message.layouts if layout.form != "header"}

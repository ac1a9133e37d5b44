"""Cases of frames with a header.

Some layouts cannot be distinguished by their bytes: they depend on a context, which may be missing.
Properties that all frames share are checked once: addresses, lengths, unknown ids and invalid contexts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.framings.header.vectors_frames import (
    ANNOUNCED,
    MOST,
    SIZE,
    addresses,
    data_frame,
    default_layout,
    header_frame,
    id_of,
    lengths_of,
    longest,
    undocumented_cases,
    unknown_id,
    unknown_sub_messages,
    with_high_length,
    without_flag,
)
from stagewire_generator.framings.header.vectors_streams import (
    ENDS,
    HeaderReader,
    layout_stream,
    stream_cases,
)
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.model_fields import Field, Format
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.subject import (
    LEFT_OUT,
    Case,
    Expected,
    Subject,
    make_case,
    no_id_case,
)
from stagewire_generator.targets.vectors.values import fields_to_bytes


def contexts(protocol: Protocol) -> dict[str, list[str]]:
    """Return the contexts that layouts depend on -> their values."""
    known: dict[str, set[str]] = {}
    for message in protocol.messages:
        for layout in message.layouts:
            for key, value in layout.when.items():
                known.setdefault(key, set()).add(value)
    return {key: sorted(values) for key, values in sorted(known.items())}


def context_cases(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield a layout selected by its context, and forms that contradict a context."""
    when = dict(of.layout.when)
    if not when:
        return
    about = "no form: the context selects it"
    yield of.encode("context", about, raw, context=when, form=LEFT_OUT)
    for key, value in when.items():
        if not any(x.when.items() <= {(key, value)} for x in of.message.layouts if x.when):
            packet = {"data": raw[SIZE:].hex(), "form": "data:undecided"}
            shared = _shared([x for x in of.message.layouts if x.when])
            fields = {field.name: of.plain.held[field.name] for field in shared}
            about = f"only the context {key} {value}, which does not select the layout"
            says = {**of.says, **packet, "fields": fields}
            yield of.decode(f"context.only_{key}", about, raw, says, context={key: value})
    for key, values in contexts(protocol).items():
        for value in values:
            if key in when and when[key] != value:
                about = f"a form that contradicts the context {key} {value}"
                name = f"context.{key}={value}"
                yield of.encode(name, about, "bad_value", context=when | {key: value})


def undecided_cases(framing: Framing, message: Message) -> Iterator[Case]:
    """Yield a packet with an unknown layout: its shared fields, and encoding it again."""
    layouts = [layout for layout in message.layouts if layout.when]
    if not layouts:
        return
    of = framing.subject(message, layouts[0])
    raw = framing.frame(of, of.plain.held)
    packet = raw[SIZE:]
    shared = {field.name: of.plain.held[field.name] for field in _shared(layouts)}
    says = {**of.says, "form": "data:undecided", "fields": shared}
    yield _case(
        of, "decode", "plain", "no context", {"hex": raw.hex()}, {**says, "data": packet.hex()}
    )
    longer = framing.frame(of, of.plain.held, b"\xa5")
    data = (packet + b"\xa5").hex()
    about = "no context, and a byte after every layout"
    yield _case(of, "decode", "extra", about, {"hex": longer.hex()}, {**says, "data": data})
    for name, about, change, expected in _encoded(shared, packet, raw, longer):
        asked = {**of.asked, "form": "data:undecided", **change}
        yield _case(of, "encode", name, about, asked, expected)


def _encoded(
    shared: Json, packet: bytes, raw: bytes, longer: bytes
) -> Iterator[tuple[str, str, Json, Expected]]:
    data = packet.hex()
    yield "data", "only data", {"data": data}, raw
    yield "shared", "fields that agree with data", {"data": data, "fields": shared}, raw
    for name, value in shared.items():
        if isinstance(value, int):
            other = {"data": data, "fields": {name: value + 1}}
            yield f"{name}.other", f"{name} contradicts data", other, "bad_value"
    yield "extra", "bytes after every layout", {"data": data, "extra": "a5"}, longer
    yield "longer", "a packet longer than every layout", {"data": data + "a5"}, longer
    yield "short", "a packet shorter than every layout", {"data": data[:-2]}, "bad_length"
    yield "missing", "no data", {"fields": shared}, "missing_field"
    unknown = {"data": data, "fields": {"no_such_field": 0}}
    yield "unknown_field", "an unknown field", unknown, "unknown_field"


def _shared(layouts: list[Layout]) -> list[Field]:
    """Return the fields that all candidates have at the same offset and in the same format."""
    first, *others = layouts
    return [
        field
        for field in first.fields
        if all(
            (field.name, field.offset, field.format)
            in [(other.name, other.offset, other.format) for other in layout.fields]
            for layout in others
        )
    ]


def _case(
    of: Subject, operation: str, name: str, about: str, more: Json, expected: Expected
) -> Case:
    id = f"{of.message.name}/data:undecided/{operation}/{name}"
    return make_case(id, about, {"op": operation, **more}, expected)


HIGH = "a length whose high byte is 1, with a packet that fits without it"


def array_cases(of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield packets whose length is not the one that their fields state."""
    id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
    packet, least, most = raw[SIZE:], of.layout.length, of.layout.longest
    array = of.layout.array
    assert array is not None
    for name, about, wrong, code in (
        ("cut", "", raw[:-1], "truncated"),
        ("cut.packet", "without its packet", raw[:SIZE], "truncated"),
        ("trailing", "", raw + b"\0", "trailing"),
        ("short", "one byte less than the fields before the array", packet[: least - 1], ""),
        ("array.none", "without its array", packet[:least], ""),
        ("array.cut", "without the last byte of its array", packet[:-1], ""),
        ("array.short", "without its last integer", packet[: -array.item.size], ""),
        (
            "array.long",
            "an integer more than its fields state",
            packet + bytes(array.item.size),
            "",
        ),
        ("array.extra", "a byte more than its fields state", packet + b"\xa5", ""),
        ("array.most", "more bytes than any packet", packet + bytes(most + 1 - len(packet)), ""),
    ):
        frame = wrong if code else data_frame(id, wrong, dest, source)
        yield of.decode(name, about, frame, code or "bad_length")
    yield of.decode("length.high", HIGH, with_high_length(raw), "truncated")
    far = data_frame(id, packet, dest, source, declared=0xFFFF)
    yield of.decode("length.most", "the greatest length in a header", far, "truncated")
    yield of.encode("extra", "bytes after an array", "bad_value", extra="00")


def protocol_cases(framing: Framing, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield the cases that all frames share; each kind of form is checked with one layout."""
    yield from _unknown(framing)
    packets = [
        of
        for of in subjects
        if of.layout.form != "header" and not of.layout.when and not of.layout.array
    ]
    headers = [of for of in subjects if of.layout.form == "header"]
    for of in (*headers[:1], *packets[:1]):
        yield from _addresses(framing, of)
        yield from _contexts(framing, of)
    for of in packets[:1]:
        yield from _packet_lengths(framing, of)
    for of in headers[:1]:
        yield from _announced(of)


def _unknown(framing: Framing) -> Iterator[Case]:
    host, device = framing.protocol.framing["host"], framing.protocol.framing["devices"][-1]
    unknown = unknown_id(framing.protocol)
    bare, packet = (
        header_frame(unknown, 0, 0, device, host),
        data_frame(unknown, b"\0", device, host),
    )
    for name, about, raw, code in (
        ("id.header", "an unknown id", bare, "unknown_message"),
        ("id.packet", "an unknown id with a packet", packet, "unknown_message"),
        ("id.trailing", "an unknown id and a trailing byte", bare + b"\0", "unknown_message"),
        ("empty", "no bytes", b"", "truncated"),
        ("byte", "one byte", bare[:1], "truncated"),
        ("header.cut", "a header without its last byte", bare[:-1], "truncated"),
    ):
        request = {"op": "decode", "hex": raw.hex()}
        yield make_case(f"frame/decode/{name}", about, request, code)
    request = {"op": "encode", "message": "NO_SUCH_MESSAGE", "dest": device, "source": host}
    yield make_case("frame/encode/message", "an unknown name", request, "unknown_message")


def _addresses(framing: Framing, of: Subject) -> Iterator[Case]:
    raw = framing.frame(of, of.plain.held)
    announced = raw[4] & ANNOUNCED
    for key, at, most in (("dest", 4, 0x7F), ("source", 5, 0xFF)):
        for name, address in (("least", 0), ("greatest", most)):
            there = bytes((address | announced if key == "dest" else address,))
            framed = raw[:at] + there + raw[at + 1 :]
            about = f"{key} at its {name}"
            said: Json = of.answer(of.plain, **{key: address})
            yield of.encode(f"{key}.{name}", about, framed, **{key: address})
            yield of.decode(f"{key}.{name}", about, framed, said)
        for name, about, value, code in (
            ("below", "is negative", -1, "out_of_range"),
            ("beyond", "does not fit in a byte", 0x100, "out_of_range"),
            ("missing", "is missing", LEFT_OUT, "missing_field"),
            ("text", "is a string", "1", "bad_value"),
            ("true", "is a boolean", True, "bad_value"),
        ):
            yield of.encode(f"{key}.{name}", f"{key} {about}", code, **{key: value})


def _contexts(framing: Framing, of: Subject) -> Iterator[Case]:
    raw = framing.frame(of, of.plain.held)
    known = contexts(framing.protocol)
    wrong = [("unknown", "an unknown context", {"no_such_context": "a"})]
    for key, values in known.items():
        wrong.append((f"{key}.unknown", f"an unknown value of {key}", {key: "no_such_value"}))
        about = f"a context for other messages: {key} {values[0]}"
        yield of.decode(f"context.{key}", about, raw, of.answer(of.plain), context={key: values[0]})
        yield of.encode(f"context.{key}", about, raw, context={key: values[0]})
    for name, about, context in wrong:
        yield of.decode(f"context.{name}", about, raw, "bad_value", context=context)
        yield of.encode(f"context.{name}", about, "bad_value", context=context)
    about = "a context that is not a string"
    yield of.decode("context.number", about, raw, "bad_request", context={"a": 1})


def _packet_lengths(framing: Framing, of: Subject) -> Iterator[Case]:
    """Yield packets of the maximum length, and longer ones."""
    id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
    lengths = {layout.length for layout in of.message.layouts}
    room = MOST - of.layout.length
    packet = framing.frame(of, of.plain.held)[SIZE:]
    if room and of.layout.length == max(lengths):
        longest = framing.frame(of, of.plain.held, bytes(room))
        extra = "00" * room
        yield of.encode("extra.most", "the longest packet", longest, extra=extra)
        answer = of.answer(of.plain, extra=extra)
        yield of.decode("extra.most", "the longest packet", longest, answer)
    about = "a packet that is too long"
    beyond = data_frame(id, packet + bytes(room + 1), dest, source)
    yield of.decode("length.above", about, beyond, "bad_length")
    far = data_frame(id, packet, dest, source, declared=0xFFFF)
    yield of.decode("length.most", "the greatest length in a header", far, "truncated")


def _announced(of: Subject) -> Iterator[Case]:
    """Yield packets without the data flag."""
    id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
    raw = header_frame(id, 1, 0, dest, source) + b"\0"
    about = "a packet without the data flag"
    yield of.decode("unannounced", about, raw, "trailing")


def _without_flag(of: Subject, bare: bytes) -> Iterator[Case]:
    """Yield frames of a message that is also received without the data flag."""
    about = "a frame without the data flag"
    yield of.decode("without_flag", about, bare, of.answer(of.plain))
    yield of.decode("without_flag.cut", f"{about}, cut", bare[:-1], "truncated")
    yield of.decode("without_flag.trailing", f"{about}, and a byte", bare + b"\0", "trailing")


_BYTE = Format("byte", 1, False, "integer")


class HeaderFraming(Framing):
    """A header of six bytes, optionally with a packet."""

    def __init__(self, protocol: Protocol) -> None:
        super().__init__(protocol)
        self._readers = {end: HeaderReader(protocol, end) for end in ENDS}

    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""
        dest, source = addresses(self.protocol, message)
        envelope = {"dest": dest, "source": source}
        reading = {"context": dict(layout.when)} if layout.when else {}
        return Subject(message, layout, _fields(layout), envelope, reading, envelope)

    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a frame with these values and extra bytes."""
        content = fields_to_bytes(of.fields, held)
        dest, source = of.asked["dest"], of.asked["source"]
        if of.layout.form == "header":
            param1, param2 = content
            return header_frame(id_of(of.message), param1, param2, dest, source)
        return data_frame(id_of(of.message), content + extra, dest, source)

    def decodes(self, of: Subject, raw: bytes) -> bool:
        """Return whether a frame is not longer than its message allows."""
        return of.layout.form == "header" or len(raw) - SIZE <= longest(of.message)

    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield frames of a wrong length, and with a wrong address or context."""
        raw = self.frame(of, of.plain.held)
        if of.layout.form == "header":
            yield of.decode("cut", "", raw[:-1], "truncated")
            yield of.decode("trailing", "", raw + b"\0", "trailing")
            about = "extra bytes without a packet"
            yield of.encode("extra", about, "bad_value", extra="00")
        else:
            yield from self._lengths(of, raw)
        about = "an address with the data flag"
        yield of.encode("dest.above", about, "out_of_range", dest=0x80)
        yield from context_cases(self.protocol, of, raw)
        yield from layout_stream(self._readers, of, raw)

    def _lengths(self, of: Subject, raw: bytes) -> Iterator[Case]:
        if of.layout.array:
            yield from array_cases(of, raw)
            return
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
        if of.message.without_flag:
            yield from _without_flag(of, without_flag(raw))
        yield of.decode("length.high", HIGH, with_high_length(raw), "truncated")
        about = "a packet that is too long"
        extra = "00" * (MOST - of.layout.length + 1)
        yield of.encode("extra.above", about, "out_of_range", extra=extra)
        lengths = lengths_of(of.message)
        dest, source = of.asked["dest"], of.asked["source"]
        if of.layout.length == min(lengths):
            short = data_frame(id_of(of.message), raw[SIZE:-1], dest, source)
            about = "a packet one byte shorter than every layout"
            yield of.decode("short", about, short, "bad_length")
        if of.layout.length < MOST and of.layout.length + 1 not in lengths:
            longer = self.frame(of, of.plain.held, b"\xa5")
            answer = of.answer(of.plain, extra="a5")
            about = "a packet one byte longer than its layout"
            yield of.encode("extra", about, longer, extra="a5")
            yield of.decode("extra", about, longer, answer)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield missing, wrong and undecided forms, and a message without a layout."""
        if message.id is None:
            yield no_id_case(message)
            return
        if not message.documented:
            yield from undocumented_cases(self.protocol, message)
            return
        by_default = default_layout(message)
        of = self.subject(message, by_default or message.layouts[0])
        raw = self.frame(of, of.plain.held)
        about = "an unknown form"
        yield of.encode("form.unknown", about, "bad_length", form="no_such_form")
        about = "no form"
        yield of.encode("form.left_out", about, raw if by_default else "bad_length", form=LEFT_OUT)
        dest, source = of.asked["dest"], of.asked["source"]
        if not any(layout.form == "header" for layout in message.layouts):
            value = message.sub_message or 0
            bare = header_frame(message.id, value & 0xFF, 0, dest, source)
            about = "a header without its packet"
            if value <= 0xFF:  # a header cannot contain a greater sub-message
                yield of.decode("header_alone", about, bare, "bad_length")
        if not lengths_of(message):
            for length in (0, 2):
                content = (message.sub_message or 0).to_bytes(2, "little")[:length]
                packet = data_frame(message.id, content, dest, source)
                about = f"a packet of {length} bytes for a message without a packet"
                yield of.decode(f"packet_of_{length}", about, packet, "bad_length")
        yield from undecided_cases(self, message)
        if message.sub_message is not None:
            unknown = unknown_sub_messages(self.protocol, message, dest, source)
            for name, (about, frame) in unknown.items():
                yield of.decode(f"sub_message.{name}", about, frame, "unknown_message")

    def of_protocol(self) -> Iterator[Case]:
        """Yield addresses, lengths, unknown messages and streams."""
        documented = [message for message in self.protocol.messages if message.layouts]
        subjects = [self.subject(m, layout) for m in documented for layout in m.layouts]
        yield from protocol_cases(self, subjects)
        yield from stream_cases(self, self._readers, subjects)


def _fields(layout: Layout) -> tuple[Field, ...]:
    """Return the fields that an encoder accepts, including unused parameters of a header."""
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

"""Cases of commands in slots, setup commands of two bytes, and replies that consist of data only.

A command to an axis has two forms, and an axis and ignored bytes besides its data. It may be a dummy.
Properties that all commands share are checked once: axes, unknown bytes, and keys of other protocols.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.framings.slots.vectors_streams import (
    MOST,
    SLOTS,
    WITH,
    WITHOUT,
    Marks,
    layout_stream,
    stream_cases,
)
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Case, Expected, Subject, make_case
from stagewire_generator.targets.vectors.values import (
    fields_from_bytes,
    fields_to_bytes,
    greatest_but,
)


def command_cases(marks: Marks, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the cases of a command; ``raw`` is its plain form as the document prints it."""
    yield from _forms(marks, of)
    yield from _sizes(marks, of)
    yield from _extra(marks, of)
    yield from _axes(marks, of)
    yield from _prefix(marks, of, raw)
    if of.message.dummy:
        about = "a dummy, which the document says not to use"
        yield of.encode("dummy", about, "unsupported", allow_dummy=LEFT_OUT)
        yield of.encode("dummy.false", about, "unsupported", allow_dummy=False)
    else:
        about = "allow_dummy for a command that is not a dummy"
        yield of.encode("dummy.allowed", about, raw, allow_dummy=True)


def _other_form(of: Subject) -> str | None:
    """Return the form that the document does not print; None for commands with data, which need a size."""
    if of.layout.length:
        return None
    return WITH if of.message.size is None else WITHOUT


def _forms(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield the command in the form that the document does not print."""
    other = _other_form(of)
    for form, slot, about in (
        (WITH, of.message.size or 0, "with the size slot"),
        (WITHOUT, None, "without the size slot"),
    ):
        if form == other:
            raw = marks.command(of, b"", slot)
            yield of.encode(f"form={form}", about, raw, form=form)
            yield of.decode(f"form={form}", about, raw, of.answer(of.plain, form=form))
        else:
            about = f"{about}, which is not a separate form"
            yield of.encode(f"form={form}", about, "bad_length", form=form)


def _sizes(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield commands with a wrong size slot, or without a required one."""
    data = fields_to_bytes(of.fields, of.plain.held)
    size = of.message.size or 0
    others = [n for n in (size - 1, size + 1, size + 2) if 0 <= n <= 255 and n != marks.terminator]
    for other in others[:2]:
        about = f"a size of {other} instead of {size}"
        yield of.decode(f"size.{other}", about, marks.command(of, data, other), "bad_length")
    if of.layout.length:
        raw = marks.command(of, b"", None)
        yield of.decode("size.missing", "no size and no data", raw, "bad_length")


def _extra(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield commands with bytes before the terminator, which a controller ignores."""
    sized = "request" if of.message.size is not None else WITH
    extra = bytes(byte for byte in (0xA5, 0x00) if byte != marks.terminator)
    yield from held_extra(marks, of, "extra", "bytes before the terminator", extra)
    end = f"{marks.terminator:02x}"
    about = "ignored bytes that contain the terminator"
    yield of.encode("extra.terminator", about, "bad_value", form=sized, extra=f"a5{end}")
    if not of.layout.length:
        unsized = WITHOUT if sized == "request" else "request"
        about = "ignored bytes without a size slot"
        yield of.encode("extra.unsized", about, "bad_value", form=unsized, extra=extra.hex())


def held_extra(marks: Marks, of: Subject, name: str, about: str, extra: bytes) -> Iterator[Case]:
    """Yield a command with ignored bytes, encoded and decoded."""
    data = fields_to_bytes(of.fields, of.plain.held)
    form = "request" if of.message.size is not None else WITH
    raw = marks.command(of, data, of.message.size or 0, extra)
    yield of.encode(name, about, raw, form=form, extra=extra.hex())
    yield of.decode(name, about, raw, of.answer(of.plain, form=form, extra=extra.hex()))


def _axes(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield invalid axes."""
    for name, about, value, code in (
        ("prefix", "is the prefix of setup commands", marks.prefix, "out_of_range"),
        ("terminator", "is the terminator", marks.terminator, "out_of_range"),
        ("below", "is negative", -1, "out_of_range"),
        ("above", "does not fit in a byte", 0x100, "out_of_range"),
        ("missing", "is missing", LEFT_OUT, "missing_field"),
        ("text", "is a string", "1", "bad_value"),
    ):
        yield of.encode(f"axis.{name}", f"the axis {about}", code, axis=value)


def _prefix(marks: Marks, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield values whose bytes look like a setup command; they are refused on request."""
    if not marks.setup:
        return
    pair = bytes((marks.prefix, min(marks.setup)))
    if pair[:1] not in raw:
        about = "a command without bytes that look like a setup command"
        yield of.encode("prefix.safe", about, raw, refuse_prefix_bytes=True)
    for field in of.fields:
        if field.format.kind != "integer" or field.format.size < len(pair):
            continue
        value = fields_from_bytes((field,), pair.ljust(field.format.size, b"\0"))[field.name]
        if field.minimum <= value <= field.maximum:
            held = {**of.plain.held, field.name: value}
            given = {**of.plain.given, field.name: value}
            there = marks.command(of, fields_to_bytes(of.fields, held), of.message.size)
            about = f"{field.name} looks like a setup command"
            name = f"prefix.{field.name}"
            yield of.encode(name, about, there, given)
            refused = f"{about} and is refused"
            yield of.encode(
                f"{name}.refused", refused, "out_of_range", given, refuse_prefix_bytes=True
            )
    if of.message.size is not None and marks.terminator not in pair:
        about = "ignored bytes look like a setup command and are refused"
        extra = pair.hex()
        refuse = {"refuse_prefix_bytes": True, "extra": extra}
        yield of.encode("prefix.extra", about, "out_of_range", **refuse)


def protocol_cases(protocol: Protocol, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield the cases that all commands share; axes are checked with the first command."""
    marks = Marks(protocol)
    for name, about, raw, code in _broken(marks, subjects):
        yield _case("decode", name, about, {"hex": raw.hex()}, code)
    for name, about, more, code in _directions(subjects):
        yield _case("decode", name, about, {"hex": "00", **more}, code)
    unknown = {"message": "NO_SUCH_MESSAGE", "axis": marks.axis}
    yield _case("encode", "message", "an unknown name", unknown, "unknown_message")
    commands = [
        of for of in subjects if of.message.kind == "command" and of.layout.form == "request"
    ]
    for of in [of for of in commands if of.message.size is not None][:1]:
        yield from _longest(marks, of)
    for of in commands[:1]:
        yield from _named_axes(protocol, marks, of)
        dest = {**of.asked, "dest": 1}
        yield _case("encode", "dest", "an address of another protocol", dest, "bad_request")
        context = {"hex": "", "context": {"status": "dc"}}
        yield _case("decode", "context", "a context of another protocol", context, "bad_request")


def _broken(marks: Marks, subjects: Sequence[Subject]) -> Iterator[tuple[str, str, bytes, str]]:
    """Yield bytes that are not a command."""
    axis, prefix, end = marks.axis, marks.prefix, marks.terminator
    ids = {of.message.id for of in subjects if of.message.kind == "command"}
    command, setup = greatest_but(ids | {end}, 1), greatest_but({*marks.setup, end}, 1)
    yield "empty", "no bytes", b"", "truncated"
    yield "axis", "only an axis", bytes((axis,)), "truncated"
    yield "prefix", "only the prefix", bytes((prefix,)), "truncated"
    yield "terminator", "only the terminator", bytes((end,)), "bad_length"
    yield "aborted", "an axis and the terminator", bytes((axis, end)), "bad_length"
    if command is not None:
        about, head = "an unknown command byte", bytes((axis, command))
        yield "command", about, head + bytes((0, end)), "unknown_message"
        yield "command.cut", f"{about} without a terminator", head, "unknown_message"
    if setup is not None:
        about = "an unknown setup command"
        yield "setup", about, bytes((prefix, setup)), "unknown_message"
    yield (
        "setup.terminator",
        "the prefix and the terminator",
        bytes((prefix, end)),
        "unknown_message",
    )
    bare = [of for of in subjects if of.message.kind == "command" and not of.layout.length]
    for of in bare[:1]:
        assert of.message.id is not None
        head = bytes((axis, of.message.id, of.message.size or 0))
        if end:
            cut = head + bytes(MOST - 1 - len(head))
            yield "unended", "no terminator yet", cut, "truncated"
            about = "no terminator within the maximum length"
            yield "unended.longest", about, cut + b"\0", "bad_length"


def _directions(subjects: Sequence[Subject]) -> Iterator[tuple[str, str, Json, str]]:
    """Yield requests with a missing or contradictory direction."""
    asked = [of for of in subjects if of.layout.form == "reply"]
    for of in asked[:1]:
        name = of.message.name
        yield (
            "command.no_reply",
            "a command without the direction reply",
            {"command": name},
            "bad_request",
        )
        more = {"command": name, "direction": "command"}
        yield "command.command", "a command with the direction command", more, "bad_request"
        more = {"command": name, "direction": "sideways"}
        yield "direction.unknown", "an unknown direction", more, "bad_request"
    yield "reply", "a reply without its command", {"direction": "reply"}, "bad_request"
    more = {"direction": "reply", "command": "NO_SUCH_MESSAGE"}
    yield "reply.unknown", "a reply to an unknown command", more, "unknown_message"


def _longest(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield a command of the maximum length, and one that is longer."""
    data = fields_to_bytes(of.fields, of.plain.held)
    room = bytes((marks.terminator ^ 1,)) * (MOST - SLOTS - len(data) - 1)
    yield from held_extra(marks, of, "extra.most", "the longest command", room)
    longer = room + room[:1]
    about = "a command that is too long"
    yield of.encode("extra.above", about, "out_of_range", extra=longer.hex())
    raw = marks.command(of, data, of.message.size, longer)
    yield of.decode("extra.above", about, raw, "bad_length")


def _named_axes(protocol: Protocol, marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield every axis that the document names, and the least and greatest valid ones."""
    axes = next(e for e in protocol.enumerations if e.name == protocol.framing["axes"])
    named = {value.value: f"={value.name}" for value in axes.values}
    possible = [byte for byte in range(256) if byte not in (marks.prefix, marks.terminator)]
    names = {possible[0]: ".least", possible[-1]: ".greatest", **named}
    raw = marks.command(of, fields_to_bytes(of.fields, of.plain.held), of.message.size)
    asked = {**of.asked, "fields": of.plain.given}
    for axis, name in names.items():
        there = bytes((axis,)) + raw[1:]
        about = f"the axis {axis:#04x}"
        yield _case("encode", f"axis{name}", about, {**asked, "axis": axis}, there)
        answer = of.answer(of.plain, axis=axis)
        yield _case("decode", f"axis{name}", about, {"hex": there.hex()}, answer)
    about = "an axis that is a boolean"
    yield _case("encode", "axis.true", about, {**asked, "axis": True}, "bad_value")


def _case(operation: str, name: str, about: str, more: Json, expected: Expected) -> Case:
    return make_case(f"frame/{operation}/{name}", about, {"op": operation, **more}, expected)


_COMMAND_ALONE = ("axis", "extra", "allow_dummy", "refuse_prefix_bytes")


class SlotsFraming(Framing):
    """An axis, a command byte, an optional size, data and a terminator."""

    def __init__(self, protocol: Protocol) -> None:
        super().__init__(protocol)
        self._marks = Marks(protocol)

    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""
        says: Json = {"kind": message.kind}
        asked: Json = {}
        reading: Json = {}
        if layout.form == "reply":
            reading = {"direction": "reply", "command": message.name}
        elif message.kind == "command":
            asked = {"axis": self._marks.axis}
            asked |= {"allow_dummy": True} if message.dummy else {}
            says["axis"] = self._marks.axis
        return Subject(message, layout, layout.fields, asked, reading, says)

    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a command as the document prints it, or of a reply."""
        data = fields_to_bytes(of.fields, held)
        if of.layout.form == "reply":
            return data
        if of.message.kind == "setup":
            assert of.message.id is not None
            return bytes((self._marks.prefix, of.message.id))
        return self._marks.command(of, data, of.message.size, extra)

    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield wrong lengths, directions and kinds, and keys that only commands have."""
        raw = self.frame(of, of.plain.held)
        reply = of.layout.form == "reply"
        for end in sorted({0 if reply else 1, 2, len(raw) // 2 + 1, len(raw) - 1}):
            if end < len(raw):
                yield of.decode(f"cut.{end}", "", raw[:end], "truncated")
        yield of.decode("trailing", "", raw + b"\0", "trailing")
        here, there = ("reply", "command") if reply else ("command", "reply")
        yield of.encode("direction", "the right direction", raw, direction=here)
        about = "a direction instead of a form"
        yield of.encode("direction.alone", about, raw, direction=here, form=LEFT_OUT)
        about = "the wrong direction"
        yield of.encode("direction.other", about, "bad_value", direction=there)
        yield of.encode("kind", "the right kind", raw, kind=of.message.kind)
        other = "setup" if of.message.kind == "command" else "command"
        yield of.encode("kind.other", "the wrong kind", "bad_value", kind=other)
        if reply or of.message.kind == "setup":
            values = (self._marks.axis, "00", True, True)
            for key, value in zip(_COMMAND_ALONE, values, strict=True):
                about = f"{key}, which only commands have"
                yield of.encode(f"{key}.refused", about, "bad_value", **{key: value})
        else:
            yield from command_cases(self._marks, of, raw)
        yield from layout_stream(self.protocol, of, raw)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield an unknown form, and a reply to a command that has none."""
        of = self.subject(message, message.layouts[0])
        about = "an unknown form"
        yield of.encode("form.unknown", about, "bad_length", form="no_such_form")
        if not any(layout.form == "reply" for layout in message.layouts):
            about = "a reply to a command without one"
            yield of.encode("form=reply", about, "bad_length", form="reply")
            reply = {"direction": "reply", "command": message.name}
            yield of.decode("reply", about, b"\0", "bad_length", **reply)

    def of_protocol(self) -> Iterator[Case]:
        """Yield axes, unknown commands, and streams."""
        messages = self.protocol.messages
        subjects = [self.subject(m, layout) for m in messages for layout in m.layouts]
        yield from protocol_cases(self.protocol, subjects)
        yield from stream_cases(self.protocol, subjects)

"""Commands in slots, setup commands of two bytes, and replies that are their data alone."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.slots_command import command_cases
from stagewire_generator.targets.vectors.slots_frame import Marks
from stagewire_generator.targets.vectors.slots_protocol import protocol_cases
from stagewire_generator.targets.vectors.slots_streams import layout_stream, stream_cases
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject
from stagewire_generator.targets.vectors.wire import fields_to_bytes

__all__ = ["SlotsFraming"]

_COMMAND_ALONE = ("axis", "extra", "allow_dummy", "refuse_prefix_bytes")


class SlotsFraming(Framing):
    """An axis, the byte of a command, perhaps a size, data, a terminator."""

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
        """Yield bytes that are too few or too many, directions and kinds, and what a command alone has."""
        raw = self.frame(of, of.plain.held)
        reply = of.layout.form == "reply"
        for end in sorted({0 if reply else 1, 2, len(raw) // 2 + 1, len(raw) - 1}):
            if end < len(raw):
                yield of.decode(f"cut.{end}", "", raw[:end], "truncated")
        yield of.decode("trailing", "", raw + b"\0", "trailing")
        here, there = ("reply", "command") if reply else ("command", "reply")
        yield of.encode("direction", "the way that it travels", raw, direction=here)
        about = "its direction in the place of its form"
        yield of.encode("direction.alone", about, raw, direction=here, form=LEFT_OUT)
        about = "the way that it does not travel"
        yield of.encode("direction.other", about, "bad_value", direction=there)
        yield of.encode("kind", "the kind that it is", raw, kind=of.message.kind)
        other = "setup" if of.message.kind == "command" else "command"
        yield of.encode("kind.other", "a kind that it is not", "bad_value", kind=other)
        if reply or of.message.kind == "setup":
            values = (self._marks.axis, "00", True, True)
            for key, value in zip(_COMMAND_ALONE, values, strict=True):
                about = f"{key}, which only a command has"
                yield of.encode(f"{key}.refused", about, "bad_value", **{key: value})
        else:
            yield from command_cases(self._marks, of, raw)
        yield from layout_stream(self.protocol, of, raw)

    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield forms and replies that a command has not."""
        of = self.subject(message, message.layouts[0])
        about = "a form that it has not"
        yield of.encode("form.unknown", about, "bad_length", form="no_such_form")
        if not any(layout.form == "reply" for layout in message.layouts):
            yield of.encode("form=reply", "a reply that it has not", "bad_length", form="reply")
            reply = {"direction": "reply", "command": message.name}
            yield of.decode("reply", "a reply that it has not", b"\0", "bad_length", **reply)

    def of_protocol(self) -> Iterator[Case]:
        """Yield axes, unknown commands, and streams."""
        messages = self.protocol.messages
        subjects = [self.subject(m, layout) for m in messages for layout in m.layouts]
        yield from protocol_cases(self.protocol, subjects)
        yield from stream_cases(self.protocol, subjects)

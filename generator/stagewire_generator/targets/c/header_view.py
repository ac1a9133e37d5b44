"""Messages that a header carries: a type and its accessors a layout."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.targets.c.documentation import message_doc
from stagewire_generator.targets.c.field_view import (
    FieldView,
    field_view,
    initialiser,
    parameter_view,
    written,
)
from stagewire_generator.targets.c.names import Names, names_of
from stagewire_generator.targets.c.source import call, definition

__all__ = ["HEADER_SIZE", "HeaderLayoutView", "HeaderMessageView", "header_message_view"]

HEADER_SIZE = 6


@dataclass(frozen=True, slots=True)
class HeaderLayoutView:
    """One layout of a message.

    :param type: the struct, and what its functions begin with.
    :param initial: the definition of its initialiser.
    :param assertion: that the struct has room for what is on the wire, where there is a packet.
    :param write: the beginning of the function that writes its fields, up to the body.
    :param written: the statements that write them.
    :param framed: the statement that writes the whole frame.
    :param checked: the expression that checks that bytes are a frame of it.
    :param encode: the beginning of the function that checks, up to the body.
    :param refused: what it refuses, a line of a condition each.
    """

    type: str
    macro: str
    doc: str
    length: int
    size: int
    assertion: str
    fields: tuple[FieldView, ...]
    written: tuple[str, ...]
    framed: str
    checked: str
    initial: str
    refused: tuple[str, ...]
    write: str
    encode: str
    encode_unchecked: str
    decode: str


@dataclass(frozen=True, slots=True)
class HeaderMessageView:
    """A message: its id, and its layouts; ``doc`` is that of one without any."""

    name: str
    macro: str
    id: str
    doc: str
    layouts: tuple[HeaderLayoutView, ...]


def header_message_view(protocol: Protocol, message: Message) -> HeaderMessageView:
    """Make the view of a message."""
    names = names_of(protocol)
    undocumented = "layout not documented"
    return HeaderMessageView(
        name=message.name,
        macro=names.macro(message.name),
        id=f"0x{message.id:04X}U",
        doc="" if message.layouts else message_doc(names, protocol, message, None, undocumented),
        layouts=tuple(_layout(names, protocol, message, layout) for layout in message.layouts),
    )


def _layout(names: Names, protocol: Protocol, message: Message, layout: Layout) -> HeaderLayoutView:
    assert message.id is not None
    type, prefix = names.layout(message, layout), names.prefix
    fields, head = _fields(names, layout), _head(layout, message.id)
    kind = "header" if layout.form == "header" else "packet"
    status, to = f"static inline {prefix}_status", [f"const {type} *message"]
    to += [f"{prefix}_addresses addresses", "uint8_t *out", "size_t cap"]
    size = f"{layout.length} bytes of data" if layout.length else "header only"
    return HeaderLayoutView(
        type=type,
        macro=type.upper(),
        doc=message_doc(names, protocol, message, layout, size),
        length=layout.length,
        size=HEADER_SIZE + layout.length,
        assertion=_assertion(names, layout, type) if layout.length else "",
        fields=fields,
        written=written(fields, fields[0].offset),
        framed=call(
            f"{type}_write_fields",
            ["message", f"{prefix}_begin_{kind}({head}, addresses, out)"],
            ";",
            4,
        ),
        checked=f"{prefix}_check_{kind}(frame, size, {head})",
        initial=definition(f"{type.upper()}_INIT", initialiser(names, fields)),
        refused=tuple(condition for field in fields for condition in field.refused),
        write=call(
            f"static inline void {type}_write_fields", [f"const {type} *message", "uint8_t *out"]
        ),
        encode=call(f"{status} {type}_encode", to),
        encode_unchecked=call(f"{status} {type}_encode_unchecked", to),
        decode=call(
            f"{status} {type}_decode", ["const uint8_t *frame", "size_t size", f"{type} *message"]
        ),
    )


def _assertion(names: Names, layout: Layout, type: str) -> str:
    facts = [f"sizeof({type}) >= {layout.length}U", f"{type}_holds_its_packet"]
    return call(f"{names.macro_prefix}_STATIC_ASSERT", facts, ";")


def _head(layout: Layout, id: int) -> str:
    """Return what a header is made from and checked against: the id, and above it the length of a packet."""
    if layout.form == "header":
        return f"0x{id:04X}U"
    return f"UINT32_C(0x{layout.length << 16 | id:08X})"


def _fields(names: Names, layout: Layout) -> tuple[FieldView, ...]:
    """Return the fields of a layout: of a header form its two parameters, named or not."""
    fields = []
    if layout.form == "header":
        parameters = ("param1", layout.param1), ("param2", layout.param2)
        for offset, (name, field) in enumerate(parameters, 2):
            fields.append(
                field_view(names, field, offset) if field else parameter_view(name, offset)
            )
    fields += [field_view(names, field, HEADER_SIZE + field.offset) for field in layout.fields]
    return tuple(fields)

"""Classes of messages that packets carry: one view a class."""

from __future__ import annotations

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.class_view import (
    ClassView,
    assignment,
    constructor,
    layout_call,
    names_line,
    packer_name,
)
from stagewire_generator.targets.python.documentation import message_doc
from stagewire_generator.targets.python.field_view import code, field_view, packed
from stagewire_generator.targets.python.source import call

__all__ = ["packet_views"]

_BASE = "PacketMessage"


def packet_views(protocol: Protocol, message: Message) -> list[ClassView]:
    """Make the views of all classes that a message becomes, one for each length of its payload."""
    names = message_classes(message)
    return [
        _with_fields(protocol, message, layout, names[layout.form])
        if layout.fields
        else _empty(protocol, message, layout, names[layout.form])
        for layout in message.layouts
    ]


def _empty(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    return ClassView(
        name=name,
        kind="empty",
        base=_BASE,
        doc=_doc(protocol, message, layout),
        slots="__slots__ = ()",
        layout=_layout(protocol, message, layout),
    )


def _with_fields(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    fields = tuple(field_view(field) for field in layout.fields)
    format = f'"<{"".join(code(field) for field in layout.fields)}"'
    packer = packer_name(name)
    return ClassView(
        name=name,
        kind="payload",
        base=_BASE,
        doc=_doc(protocol, message, layout),
        slots=names_line("__slots__ = ", sorted(field.name for field in fields)),
        layout=_layout(protocol, message, layout),
        signature=constructor(layout.fields, fields),
        fields=fields,
        packer=call(f"{packer} = Struct", [format], "", 0),
        unpacker=call("_unpack = Struct", [format], ".unpack_from", 4),
        unpack=assignment(fields),
        pack=call(f"return {packer}.pack", [packed(field) for field in layout.fields], "", 8),
        noun="message",
        unpacked="the bytes of a payload",
        packed="the bytes of the payload",
    )


def _layout(protocol: Protocol, message: Message, layout: Layout) -> str:
    id = _id(protocol, message)
    return layout_call(message.name, id, message.direction, layout.form, layout.fields, [])


def _id(protocol: Protocol, message: Message) -> str:
    assert message.id is not None
    return f"0x{message.id:0{protocol.id_digits}X}"


def _doc(protocol: Protocol, message: Message, layout: Layout) -> str:
    size = f"{layout.length} byte{'s' * (layout.length > 1)} of payload"
    named = f"``{message.name}`` ({_id(protocol, message)})"
    return message_doc(protocol, message, layout, named, size if layout.length else "no payload")

"""Classes of messages that packets carry: one view a class."""

from __future__ import annotations

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.class_view import ClassView, layout_call, payload_view
from stagewire_generator.targets.python.documentation import message_doc

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
    doc, made = _doc(protocol, message, layout), _layout(protocol, message, layout)
    words = ("message", "the bytes of a payload", "the bytes of the payload")
    return payload_view(name, _BASE, doc, made, layout, words)


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

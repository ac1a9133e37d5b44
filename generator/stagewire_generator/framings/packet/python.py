"""Python classes of messages that packets carry, one view a class, and their protocol object."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.class_view import ClassView, layout_call, payload_view
from stagewire_generator.targets.python.documentation import message_doc
from stagewire_generator.targets.python.framing import Framing, named, nameless
from stagewire_generator.targets.python.source import (
    SUPPORT,
    WIDTH,
    bracketed,
    call,
    imported,
    literal,
    tuple_of,
)

_CHECKS = {"sum": "Sum", "xor": "Xor", "crc": "Crc"}  # method -> class


def check_class(framing: Json) -> list[str]:
    """Return the name of the class of the check, if there is one."""
    return [_CHECKS[framing["check"]["method"]]] if "check" in framing else []


def shape(framing: Json) -> str:
    """Return the argument ``shape=`` of a protocol."""
    arguments = [
        _parts("order", framing["order"]),
        f"start={_bytes(framing['start'])}",
        f"length={framing['length']['size']}",
        _parts("counts", framing["length"]["counts"]),
        f"id={framing['id']['size']}",
        f"maximum={framing['maximum_length']}",
    ]
    if "address" in framing:
        arguments.append(f"address={framing['address']['size']}")
    if "check" in framing:
        arguments += [_check(framing["check"]), _parts("covers", framing["check"]["covers"])]
    if "end" in framing:
        arguments.append(f"end={_bytes(framing['end'])}")
    return bracketed("shape=Shape(", arguments, ")", 4, 0)


def _check(check: Json) -> str:
    digits = 2 * check["size"]
    arguments = {
        "sum": [f"size={check['size']}", f"complement={literal(check.get('complement', ''))}"],
        "xor": [],
        "crc": [
            f"size={check['size']}",
            *(f"{key}=0x{check.get(key, 0):0{digits}X}" for key in ("polynomial", "initial")),
            f"reflected={check.get('reflected')}",
            f"final=0x{check.get('final', 0):0{digits}X}",
        ],
    }
    method = check["method"]
    return bracketed(f"check={_CHECKS[method]}(", arguments[method], ")", 8, WIDTH - 1)


def _parts(name: str, parts: Iterable[str]) -> str:
    return f"{name}={tuple_of([literal(part) for part in parts])}"


def _bytes(values: Iterable[int]) -> str:
    """Return a bytes literal, every byte as an escape: they are numbers and no text."""
    return 'b"' + "".join(f"\\x{value:02x}" for value in values) + '"'


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


def _packet_protocol(protocol: Protocol) -> str:
    lines = [*named(protocol), shape(protocol.framing), nameless(protocol)]
    return call("PROTOCOL = PacketProtocol", lines, "", 0, 0)


def _packet_imports(protocol: Protocol) -> tuple[str, ...]:
    names = ["PacketMessage", "PacketProtocol", "Shape", *check_class(protocol.framing)]
    return (imported(SUPPORT, [*names, "require as _require"]),)


FRAMING = Framing(
    class_views=packet_views,
    message_base="PacketMessage",
    imports=_packet_imports,
    protocol=_packet_protocol,
)

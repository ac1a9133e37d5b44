"""Python classes of commands and their replies, one view per class, and the protocol object."""

from __future__ import annotations

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.documentation import errata_of, sentence
from stagewire_generator.targets.python.brackets import Nested, call, mapping
from stagewire_generator.targets.python.class_view import (
    ClassView,
    layout_call,
    packer_name,
    parameters,
    payload_view,
)
from stagewire_generator.targets.python.devices.plan import DEVICE, DeviceFraming, Shape
from stagewire_generator.targets.python.field_view import code, field_view, packed
from stagewire_generator.targets.python.framing import Framing, named
from stagewire_generator.targets.python.source import class_doc, command_doc, literal


def command_views(protocol: Protocol, message: Message) -> list[ClassView]:
    """Make the views of the classes of a command. The reply comes first: the command refers to it."""
    layouts = {layout.form: layout for layout in message.layouts}
    names = message_classes(message)
    request = layouts["request"]
    if message.kind == "setup":
        return [_setup(protocol, message, request, names["request"])]
    views = []
    if "reply" in layouts:
        views.append(_reply(protocol, message, layouts["reply"], names["reply"]))
    reply = names.get("reply", "None")
    views.append(_command(protocol, message, request, names["request"], reply))
    return views


def _setup(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    prefix = f"0x{protocol.framing['prefix']:02X}"
    facts = f"``{message.name}`` ({prefix} {_byte(message)}), two bytes"
    more = ['kind="setup"']
    if message.switches_to:
        more.append(f"switches_to={literal(message.switches_to)}")
    return ClassView(
        name=name,
        kind="empty",
        base="SetupCommand",
        doc=command_doc(protocol, message, layout, facts),
        layout=_layout(message, layout, more),
    )


def _command(
    protocol: Protocol, message: Message, layout: Layout, name: str, reply: str
) -> ClassView:
    more = ['kind="command"']
    if message.size is not None:
        more.append(f"size={message.size}")
    if message.dummy:
        more.append("dummy=True")
    carried = _bytes(layout.length) + " of data" if layout.length else "no data"
    slot = "no size slot" if message.size is None else f"size {message.size}"
    facts = f"``{message.name}`` ({_byte(message)}), {carried}, {slot}"
    bare = ClassView(
        name=name,
        kind="bare",
        base="Command",
        doc=command_doc(protocol, message, layout, facts),
        layout=_layout(message, layout, more),
        reply=reply,
    )
    return _with_data(protocol, message, bare, layout) if layout.fields else bare


def _with_data(protocol: Protocol, message: Message, bare: ClassView, layout: Layout) -> ClassView:
    """Return the view of a command with data, which follows the size slot."""
    codes = "".join(code(field) for field in layout.fields)
    end = f"0x{protocol.framing['terminator']:02X}"
    head = ("axis", _byte(message), str(message.size))
    return bare._replace(
        kind="command",
        parameters=parameters(layout.fields),
        fields=tuple(field_view(field) for field in layout.fields),
        packer=packer_name(bare.name),
        sent_format=f"<BBB{codes}B",
        read_format=f"<3x{codes}",
        packed=(*head, *(packed(field) for field in layout.fields), end),
    )


def _reply(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    first = f"Reply to ``{message.name}``, {_bytes(layout.length)}."
    summary = "A reply has no frame. Its meaning depends on the command that was sent."
    note = sentence(layout.note) if layout.note else ""
    of_fields = [slug for field in layout.fields for slug in field.errata]
    doc = class_doc(first, [summary, note], layout.fields, errata_of(protocol, of_fields))
    made = _layout(message, layout, ['kind="command"'])
    words = ("reply", "the bytes", "the bytes of the reply")
    return payload_view(name, "Reply", doc, made, layout, words)


def _layout(message: Message, layout: Layout, more: list[str]) -> Nested:
    direction = "to_host" if layout.form == "reply" else message.direction
    return layout_call(message.name, _byte(message), direction, layout.form, layout.fields, more)


def _byte(message: Message) -> str:
    assert message.id is not None
    return f"0x{message.id:02X}"


def _bytes(number: int) -> str:
    return f"{number} byte{'s' if number > 1 else ''}"


def _command_protocol(protocol: Protocol) -> Nested:
    framing = protocol.framing
    axes = next(e for e in protocol.enumerations if e.name == framing["axes"])
    pairs = [f"{literal(axis.name)}: 0x{axis.value:02X}" for axis in axes.values]
    lines = [
        *named(protocol),
        f"prefix=0x{framing['prefix']:02X}",
        f"terminator=0x{framing['terminator']:02X}",
        mapping("axes=", pairs),
    ]
    return call("CommandProtocol", lines, broken=True)


FRAMING = Framing(
    class_views=command_views,
    message_base="Message",
    imports=lambda _: ("CommandProtocol", "Message"),
    protocol=_command_protocol,
)


_AXES: Shape = {"channel": ("Axis", "Axis"), DEVICE: ("", "AxesDevice")}

DEVICES = DeviceFraming(
    shape=lambda protocol, entry: _AXES,
    addresses=lambda protocol, entry: iter(['kind="line"']),
    names_channel=lambda protocol, calls: calls[0].message.kind == "command",
)

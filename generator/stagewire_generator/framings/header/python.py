"""Python classes of messages with a header, one view per class, and the protocol object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.naming import camel, message_classes
from stagewire_generator.targets.documentation import shown_id, where
from stagewire_generator.targets.python.brackets import (
    Nested,
    Source,
    Text,
    call,
    mapping,
    strings,
)
from stagewire_generator.targets.python.class_view import (
    ClassView,
    SharedView,
    layout_call,
    packer_name,
    parameters,
)
from stagewire_generator.targets.python.devices.plan import DEVICE, Call, DeviceFraming, Shape
from stagewire_generator.targets.python.field_view import (
    Slot,
    code,
    field_view,
    integer_code,
    packed,
    type_of,
    value_of,
    wire_type,
)
from stagewire_generator.targets.python.framing import Framing, named, nameless
from stagewire_generator.targets.python.source import (
    docstring,
    integer,
    literal,
    message_doc,
    paragraph,
)


def message_views(protocol: Protocol, message: Message) -> list[ClassView]:
    """Make the views of all classes of a message."""
    if not message.documented:
        return [_undocumented(protocol, message)]
    names = message_classes(message)
    views = [_plain(protocol, message, layout, names[layout.form]) for layout in message.layouts]
    contextual = [layout for layout in message.layouts if layout.when]
    if contextual:
        views.append(_undecided(protocol, message, contextual))
    return views


def _slots(layout: Layout) -> list[Slot]:
    """Return the fields of a class; an unused header parameter is a bare name."""
    slots: list[Slot] = []
    if layout.form == "header":
        for name, field in (("param1", layout.param1), ("param2", layout.param2)):
            slots.append(field or name)
    return [*slots, *layout.fields]


def _plain(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    slots = _slots(layout)
    header = layout.form == "header"
    codes = "".join(code(slot) for slot in slots)
    values: list[Source] = [packed(slot) for slot in slots]
    if header:
        values = [_id(message), *values, "dest", "source"]
    else:
        values = [f"{layout.length} << 16 | {_id(message)}", "dest | 0x80", "source", *values]
    more: list[Source] = []
    if layout.when:
        more.append(
            mapping("when=", [f"{literal(k)}: {literal(v)}" for k, v in layout.when.items()])
        )
    if layout.only_zero:
        more.append("only_zero=True")
    more += _of_message(message)
    if layout.array:
        return _counted(protocol, message, layout, name)
    return ClassView(
        name=name,
        kind="plain",
        base="FramedMessage",
        doc=_doc(protocol, message, layout),
        layout=layout_call(message.name, _id(message), message.direction, layout.form, slots, more),
        parameters=parameters(slots),
        fields=tuple(field_view(slot) for slot in slots),
        packer=packer_name(name),
        sent_format=f"<H{codes}BB" if header else f"<LBB{codes}",
        read_format=f"<2x{codes}2x" if header else f"<6x{codes}",
        packed=tuple(values),
    )


def _counted(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    """Make the view of a class whose packet ends with an array."""
    *before, field = layout.fields
    array = layout.array
    assert array is not None
    codes = "".join(code(slot) for slot in before)
    places = {f.name: (f.offset, f.format.size) for f in before}
    counted: list[Source] = [
        literal(field.name),
        f"code={literal(integer_code(array.item))}",
        f"least={layout.length}",
        f"most={layout.longest}",
        f"rows={literal(array.rows)}",
        f"single={array.single}",
        strings("masks=", array.masks) if array.masks else "masks=()",
        mapping("places=", [f"{literal(other)}: {places[other]}" for other in array.fields]),
    ]
    values = mapping("", [f"{literal(other)}: {other}" for other in array.fields])
    limits = [integer(field.minimum), integer(field.maximum)]
    head = layout_call(
        message.name,
        _id(message),
        message.direction,
        layout.form,
        layout.fields,
        _of_message(message),
    )
    return ClassView(
        name=name,
        kind="counted",
        base="CountedMessage",
        doc=_doc(protocol, message, layout),
        layout=head,
        parameters=parameters(layout.fields),
        fields=tuple(field_view(slot) for slot in layout.fields),
        packer=packer_name(name),
        sent_format=f"<{codes}",
        packed=tuple(packed(slot) for slot in before),
        read_format=f"<6x{codes}",
        counted=call("Counted", counted, broken=True),
        checked=call("cls.counted.check", ["cls.layout", field.name, *limits, values]),
    )


def _id(message: Message) -> str:
    assert message.id is not None
    return f"0x{message.id:04X}"


def _of_message(message: Message) -> list[Source]:
    """Return the arguments of every Layout of a message."""
    unsolicited: list[Source] = ["unsolicited=True"] if message.exchange.get("unsolicited") else []
    if message.not_sent:
        unsolicited.append(Text("not_sent=", message.not_sent))
    if message.without_flag:
        unsolicited.append("without_flag=True")
    if message.sub_message is None:
        return unsolicited
    return [*unsolicited, f"sub_message={message.sub_message}"]


def _undocumented(protocol: Protocol, message: Message) -> ClassView:
    arguments = [
        literal(message.name),
        f"id={_id(message)}",
        f"direction=Direction.{message.direction.upper()}",
        'form="undocumented"',
        'fields=("data", "param1", "param2")',
        'optional=("param1", "param2")',
        'unnamed=("param1", "param2")',
        *_of_message(message),
    ]
    return ClassView(
        name=message.class_name,
        kind="empty",
        base="UndocumentedMessage",
        doc=_doc(protocol, message, None),
        layout=call("Layout", arguments, broken=True),
    )


def _undecided(protocol: Protocol, message: Message, layouts: list[Layout]) -> ClassView:
    first, *others = layouts
    shared = [
        field
        for field in first.fields
        if all(
            any(
                (f.name, f.offset, f.format) == (field.name, field.offset, field.format)
                for f in o.fields
            )
            for o in others
        )
    ]
    arguments = [
        literal(message.name),
        f"id={_id(message)}",
        f"direction=Direction.{message.direction.upper()}",
        'form="data:undecided"',
        'fields=("data",)',
        f"length={first.length}",
        *_of_message(message),
    ]
    choices = " or ".join(
        " and ".join(f"{k} {v}" for k, v in layout.when.items()) for layout in layouts
    )
    text = (
        f"``{message.name}`` ({shown_id(protocol, message)}) with an unknown layout; "
        f"{where(protocol, message.pages[:1], message.overlay)}.\n\n    "
        + paragraph(
            f"{message.summary} The layout depends on the controller ({choices}), and the bytes do not "
            "show which one it is. The fields that all layouts share can be read. Encoding writes "
            "``data`` unchanged.",
            4,
        )
    )
    views = tuple(
        SharedView(
            name=field.name,
            type=type_of(field),
            wire_type=wire_type(field),
            format=f"<{code(field)}",
            offset=field.offset,
            returned=value_of(field, "value"),
        )
        for field in shared
    )
    return ClassView(
        name=message.class_name + "Undecided",
        kind="undecided",
        base="UndecidedMessage",
        doc=docstring(text),
        layout=call("Layout", arguments, broken=True),
        shared=views,
    )


def _doc(protocol: Protocol, message: Message, layout: Layout | None) -> str:
    size = "layout not documented"
    if layout is not None:
        size = f"{layout.length} bytes of data" if layout.length else "header only"
    if layout is not None and layout.array:
        size = f"{layout.length} to {layout.longest} bytes of data"
    return message_doc(
        protocol, message, layout, f"``{message.name}`` ({shown_id(protocol, message)})", size
    )


def _framed_protocol(protocol: Protocol) -> Nested:
    framing = protocol.framing
    devices = mapping("", [f"0x{d:02X}" for d in framing["devices"]])
    lines: list[Source] = [
        *named(protocol),
        f"host=0x{framing['host']:02X}",
        call("devices=frozenset", [devices]),
        nameless(protocol),
    ]
    if "channel" in framing:
        lines.append(f"channel={literal(framing['channel'])}")
    faults = _faults(protocol)
    if faults:
        lines.append(mapping("faults=", faults))
    others = [
        f"{literal(other)}: {literal(m.name)}" for m in protocol.messages for other in m.aliases
    ]
    if others:
        lines.append(mapping("aliases=", others))
    return call("FramedProtocol", lines, broken=True)


def _faults(protocol: Protocol) -> list[str]:
    """Return the messages that report a fault, each with the positions of its parts."""
    places = {m.id: m.exchange.get("reports_fault", {}) for m in protocol.messages}
    return [
        f"0x{id:04X}: FaultPlaces({', '.join(f'{k}={v}' for k, v in at.items() if k != 'source')})"
        for id, at in places.items()
        if id is not None and at
    ]


def _framed_imports(protocol: Protocol) -> tuple[str, ...]:
    faults = ["FaultPlaces"] if _faults(protocol) else []
    return (*faults, "FramedMessage", "FramedProtocol")


FRAMING = Framing(
    class_views=message_views,
    message_base="FramedMessage",
    imports=_framed_imports,
    protocol=_framed_protocol,
)


_SINGLE: dict[str, Shape] = {
    "generic_usb": {DEVICE: ("", "SingleChannelDevice")},
    "rack": {"bay": ("Bay", "Bay"), DEVICE: ("", "RackDevice")},
    "bay": {DEVICE: ("", "SingleChannelModule")},
}
_SEVERAL: dict[str, Shape] = {
    "generic_usb": {"channel": ("Channel", "Channel"), DEVICE: ("", "ChannelsDevice")},
    "rack": {
        "channel": ("Channel", "Channel"),
        "bay": ("Bay", "ChannelsBay"),
        DEVICE: ("", "RackDevice"),
    },
    "bay": {"channel": ("Channel", "Channel"), DEVICE: ("", "ModuleDevice")},
}


def _shape(protocol: Protocol, entry: Json) -> Shape:
    several = entry.get("channels", 1) > 1 and "channel" in protocol.framing
    return (_SEVERAL if several else _SINGLE)[entry.get("address", "generic_usb")]


def _addresses(protocol: Protocol, entry: Json) -> Iterator[Source]:
    """Yield how a unit is addressed: its kind, its address, the addresses of its bays, its channels."""
    known = protocol.units.get("addresses", {})
    kind = entry.get("address", "generic_usb")
    yield f"kind={literal(kind)}"
    own = known.get("generic_usb" if kind == "generic_usb" else "motherboard")
    address = own["value"] if own else protocol.framing["devices"][0]
    family = protocol.units.get("families", {}).get(entry.get("family"), {})
    found = entry.get("also_at", family.get("also_at", {}))
    others = found.get("addresses", [])
    if "preferred" in found:
        others = [address, *(other for other in others if other != found["preferred"])]
        address = found["preferred"]
    yield f"address=0x{address:02X}"
    if others:
        yield Nested("also_at=(", tuple(f"0x{other:02X}" for other in others), ")")
    if kind != "generic_usb" and "bays" in known:
        first, last = known["bays"]["first"], known["bays"]["last"]
        count = entry.get("bays", last - first + 1)
        bays = tuple(f"0x{address:02X}" for address in range(first, last + 1)[:count])
        yield Nested("bays=(", bays, ")")
    yield f"channels={entry.get('channels', 1)}"
    if "channel_idents" in entry:
        yield f"idents=e.{camel(entry['channel_idents'])}"


def _names_channel(protocol: Protocol, calls: Sequence[Call]) -> bool:
    channel = protocol.framing.get("channel")
    layouts = [x for c in calls for m in c.members.values() for x in m.layouts]
    return any(field.name == channel for layout in layouts for field in layout.all_fields)


DEVICES = DeviceFraming(_shape, _addresses, _names_channel)

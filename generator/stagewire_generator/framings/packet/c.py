"""Messages in packets in C: a type and its functions for each layout, the parser, and the tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from stagewire_generator.framings.packet.c_shape import PacketParts, packet_shape_view
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.c.field_view import (
    FieldView,
    field_view,
    initialiser,
    size_assertion,
    written,
)
from stagewire_generator.targets.c.framing import File, Framing, Tests
from stagewire_generator.targets.c.source import (
    EntryView,
    Names,
    call,
    definition,
    message_doc,
    names_of,
    string,
    unsigned,
)
from stagewire_generator.targets.vectors.subject import Subject


class PacketLayoutView(NamedTuple):
    """A layout of a message.

    :param type: the struct, and the prefix of its functions; without fields there is no struct.
    :param assertion: the assertion on the size of the struct; empty without a struct.
    :param length: length of its payload in bytes.
    :param size: length of the packet in bytes.
    :param begun: the statement that writes the parts before the payload, and the fields.
    :param checked: the call that checks that bytes are a packet of this layout.
    :param refused: the conditions for values out of range.
    :param encode: the head of the encoder with range checks.
    :param unchecked: the call of the encoder without range checks.
    """

    type: str
    macro: str
    doc: str
    assertion: str
    length: int
    size: int
    fields: tuple[FieldView, ...]
    written: tuple[str, ...]
    initial: str
    begun: str
    checked: str
    refused: tuple[str, ...]
    write: str
    encode: str
    unchecked: str
    encode_unchecked: str
    decode: str


class PacketMessageView(NamedTuple):
    """A message: its id and its layouts."""

    name: str
    macro: str
    id: str
    layouts: tuple[PacketLayoutView, ...]


def packet_message_view(protocol: Protocol, message: Message) -> PacketMessageView:
    """Make the view of a message."""
    names = names_of(protocol)
    return PacketMessageView(
        name=message.name,
        macro=names.macro(message.name),
        id=f"0x{message.id:0{protocol.id_digits}X}U",
        layouts=tuple(_layout(names, protocol, message, layout) for layout in message.layouts),
    )


def _layout(names: Names, protocol: Protocol, message: Message, layout: Layout) -> PacketLayoutView:
    type, prefix = names.layout(message, layout), names.prefix
    shape = packet_shape_view(protocol)
    parts = PacketParts(protocol.framing)
    fields = tuple(
        field_view(names, field, parts.payload_at + field.offset, "packet")
        for field in layout.fields
    )
    content = [f"const {type} *message"] if fields else []
    receiver = [f"{shape.address.type} address"] if shape.address else []
    to = [*content, *receiver, "uint8_t *out", "size_t cap"]
    into = [f"{type} *message"] if fields else []
    given = [*(["message"] if fields else []), *(["address"] if receiver else []), "out", "cap"]
    head = f"UINT32_C(0x{layout.length << 16 | (message.id or 0):08X})"
    arguments = [head, "out", *(["address"] if receiver else [])]
    begun = f"{prefix}_begin_packet({', '.join(arguments)})"
    status = f"static inline {prefix}_status"
    size = f"{layout.length} bytes of payload" if layout.length else "no payload"
    return PacketLayoutView(
        type=type,
        macro=type.upper(),
        doc=message_doc(names, protocol, message, layout, size),
        assertion=size_assertion(names, layout, type) if fields else "",
        length=layout.length,
        size=parts.overhead + layout.length,
        fields=fields,
        written=written(fields, parts.payload_at),
        initial=definition(f"{type.upper()}_INIT", initialiser(names, fields)),
        begun=_begun(type if fields else "", begun),
        checked=call(
            f"{prefix}_check_packet",
            ["packet", "size", head, f"{_most(protocol, message, layout)}U"],
            ";",
            4 + len(f"const {prefix}_status status = "),
        ),
        refused=(
            *(
                [f"address > {prefix.upper()}_HIGHEST_ADDRESS"]
                if parts.size("address") == 3
                else []
            ),
            *(condition for field in fields for condition in field.refused),
        ),
        write=call(
            f"static inline void {type}_write_fields", [f"const {type} *message", "uint8_t *out"]
        ),
        encode=call(f"{status} {type}_encode", to),
        unchecked=f"{type}_encode_unchecked({', '.join(given)})",
        encode_unchecked=call(f"{status} {type}_encode_unchecked", to),
        decode=call(f"{status} {type}_decode", ["const uint8_t *packet", "size_t size", *into]),
    )


def _begun(type: str, begun: str) -> str:
    """Return the statement that begins a packet and writes the fields of its type, if it has one."""
    return call(f"{type}_write_fields", ["message", begun], ";", 4) if type else f"(void){begun};"


def _most(protocol: Protocol, message: Message, layout: Layout) -> int:
    """Return the bytes of the longest payload that is read by this layout: a longer one may be another's."""
    if not layout.length:
        return 0
    longer = [other.length for other in message.layouts if other.length > layout.length]
    most: int = min(longer) - 1 if longer else protocol.framing["maximum_length"]
    return most


class PacketTableView(NamedTuple):
    """The table.

    :param entries: by id, then by length; an id with payloads of several lengths has a row for each.
    :param start: how many bytes begin every packet.
    """

    entries: tuple[EntryView, ...]
    start: int


def packet_table_view(protocol: Protocol) -> PacketTableView:
    """Make the view of the table."""
    rows = sorted(
        (message.id, length, message.name)
        for message in protocol.messages
        if message.id is not None
        for length in {layout.length for layout in message.layouts}
    )
    digits = protocol.id_digits
    return PacketTableView(
        entries=tuple(
            EntryView(f"{{0x{id:0{digits}X}U, {length}U}}", string(name))
            for id, length, name in rows
        ),
        start=len(protocol.framing["start"]),
    )


def _meant(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the layouts of the message with the id of the bytes."""
    at, size = PacketParts(protocol.framing).offset("id"), protocol.framing["id"]["size"]
    id = int.from_bytes(raw[at : at + size], "little")
    known = [of for of in every if of.message.id == id and len(raw) >= at + size]
    return known or every


def _round_trip(protocol: Protocol) -> dict[str, Any]:
    """Return an address, and where in packets something can be changed."""
    framing = protocol.framing
    parts = PacketParts(framing)
    guarded = [part for part in ("check", "end") if part in framing]
    damaged_at = parts.overhead - parts.offset(guarded[0]) if guarded else 0
    size = parts.size("address") if "address" in framing else 0
    address = int.from_bytes(range(1, size + 1), "little")
    return {
        "address": unsigned(address, size, 2 * size) if size else "",
        "id_at": parts.offset("id"),
        "damaged_at": damaged_at,
    }


FRAMING = Framing(
    message="packet_message.h.j2",
    message_view=packet_message_view,
    testee="packet_testee.c.j2",
    files=(
        File("wire.h", "packet_wire.h.j2", packet_shape_view, included=True),
        File("parser.h", "packet_parser.h.j2", included=True),
        File("{package}.c", "packet_parser.c.j2", packet_table_view),
    ),
    tests=Tests(
        calls="packet_calls.c.j2",
        cut="testing_cut.c.j2",
        trip="packet_trip.c.j2",
        trip_needs="packet_trip_needs.c.j2",
        data_at=lambda protocol, of: PacketParts(protocol.framing).payload_at,
        meant=_meant,
        damaged="bad_value",
        round_trip=_round_trip,
    ),
)

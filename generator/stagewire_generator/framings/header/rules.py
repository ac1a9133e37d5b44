"""Rules for specs with a header framing, and the comparison with their document."""

from __future__ import annotations

from collections import defaultdict

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import Rules
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.lists import MESSAGE_CHAPTERS
from stagewire_generator.lint.witness.reading import FILLERS, data_layout, squash
from stagewire_generator.lint.witness.witness import Witness
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.strict_yaml import Document, KeyPath


def check_header(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check addresses and sub-messages."""
    _addresses(protocol, head, diagnostics)
    of_id: dict[int, list[Message]] = defaultdict(list)
    for message in protocol.messages:
        if message.id is not None:
            of_id[message.id].append(message)
    for messages in of_id.values():
        if any(message.sub_message is not None for message in messages):
            _sub_messages(messages, diagnostics)


def _sub_messages(messages: list[Message], diagnostics: Diagnostics) -> None:
    """Check that the bytes select one of the messages of an id."""
    first = next(message for message in messages if message.sub_message is not None)
    for message in messages:
        value = message.sub_message
        if value is None:
            what = f"{message.name} has no sub-message, but {first.name} has the same id and one"
            diagnostics.add(message.place, "SW090", what)
            continue
        if message.direction != first.direction:
            what = f"{message.name} and {first.name} have the same id, but not the same direction"
            hint = "messages of one id travel in the same direction; compare both with the document"
            diagnostics.add(message.place, "SW090", what, hint)
        if not message.documented:
            what = f"{message.name} has a sub-message, but no layout that shows where it is"
            hint = "describe the layout, or remove `sub_message`"
            diagnostics.add(message.place, "SW090", what, hint)
        for layout in message.layouts:
            header = layout.form == "header"
            field = layout.param1 if header else next(iter(layout.fields), None)
            size = 1 if header else 2
            if field is None or not field.selects or field.format.size != size:
                begin = f"param1: {{constant: {value}}}"
                if not header:
                    begin = f"the field {{format: word, role: constant, value: {value}}}"
                what = (
                    f"{message.name} ({layout.form}): does not begin with its sub-message {value}"
                )
                diagnostics.add(layout.place, "SW090", what, f"begin it with {begin}")


def _addresses(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the addresses: they must not use the data flag, and host and devices must differ."""
    framing = protocol.framing
    host, flag = framing["host"], framing["data_flag"]
    channel = framing.get("channel")
    fields = {field.name for m in protocol.messages for x in m.layouts for field in x.all_fields}
    if channel is not None and channel not in fields:
        what = f"no message has the field {channel}, which should name the channel"
        diagnostics.add(head.place("framing", "channel"), "SW021", what)
    free = "in an address, the bit of the data flag must be clear; see the document"
    if host & flag:
        what = f"the host's address {host:#04x} contains the data flag"
        diagnostics.add(head.place("framing", "host"), "SW038", what, free)
    for index, device in enumerate(framing["devices"]):
        place = head.place("framing", "devices", index)
        if device & flag:
            diagnostics.add(
                place, "SW038", f"the address {device:#04x} contains the data flag", free
            )
        if device == host:
            what = f"{device:#04x} is the address of both the host and a device"
            diagnostics.add(place, "SW038", what, "one of the two is wrong; see the document")


def compare_tables(
    comparison: Comparison, message: Message, tables: list[Json], path: KeyPath
) -> None:
    """Compare the byte tables of a message; each begins with a header."""
    for index, table in enumerate(tables):
        where = f"table/{message.name}" if index == 0 else f"table{index + 1}/{message.name}"
        _table(comparison, where, message, table, (*path, index))


def _table(
    comparison: Comparison, where: str, message: Message, table: Json, path: KeyPath
) -> None:
    layout = _layout_of(message, table)
    cells = table.get("header", [])
    at = (*path, "header")
    if message.id is not None and len(cells) == 6:
        id = f"{message.id & 0xFF:02X} {message.id >> 8:02X}"
        comparison.same(f"{where}/id", at, f"{cells[0]} {cells[1]}", id)
    if layout is None:
        return
    data = layout.form != "header"
    total = 6 + layout.length
    for key, encoded in (
        ("structure", total),
        ("packet", layout.length),
        ("last_offset", total - 1),
    ):
        if key in table:
            known = "variable" if layout.array else encoded
            comparison.same(f"{where}/{key}", (*path, key), table[key], known)
    if len(cells) == 6:
        if data:
            length = f"{layout.length & 0xFF:02X} {layout.length >> 8:02X}"
            if layout.array:
                length = "xx xx"  # any: the fields of the packet state it
            comparison.same(f"{where}/length", at, f"{cells[2]} {cells[3]}", length)
        else:
            _param(comparison, f"{where}/param1", layout.param1, cells[2], at)
            _param(comparison, f"{where}/param2", layout.param2, cells[3], at)
        if data:
            comparison.same("headers/bar", at, cells[4], "d|")
        comparison.same(f"{where}/dest", at, cells[4].strip()[:1], "d")
        comparison.same(f"{where}/source", at, cells[5].lower(), "s")
    else:
        comparison.same(f"{where}/cells", at, len(cells), 6)
    if "columns" in table and data:
        at = (*path, "columns")
        comparison.names(f"{where}/columns/{{}}", at, table["columns"], layout.fields)


def _layout_of(message: Message, table: Json) -> Layout | None:
    """Return the layout that a byte table shows."""
    header = next((x for x in message.layouts if x.form == "header"), None)
    data = data_layout(message, [table])
    packed = "columns" in table or "packet" in table or table.get("structure", 0) > 6
    return (data or header) if packed else (header or data)


def _param(
    comparison: Comparison, place: str, field: Field | None, cell: str, path: KeyPath
) -> None:
    if field is None:
        if cell != "0" and squash(cell) not in FILLERS:
            comparison.same(place, path, cell, "00")
    elif field.constant is not None:
        comparison.same(place, path, cell, f"{field.constant:02X}")
    elif squash(cell) != squash(field.name):
        comparison.differs(place, path, cell, field.name)


RULES = Rules(
    check=check_header,
    kinds=("message",),
    keys=("header_length", "data_flag", "maximum_length", "host", "devices", "channel"),
    id_size=2,
    has_parameters=True,
    has_sub_messages=True,
    has_arrays=True,
    reports_faults=True,
)
WITNESS = Witness(MESSAGE_CHAPTERS, sections=True, tables=compare_tables)

"""Messages with a header in C: a type and its functions for each layout, the parser, and the tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from stagewire_generator.framings.header.vectors_frames import sub_message_of
from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.naming import c_aliases
from stagewire_generator.targets.c.field_view import (
    FieldView,
    field_view,
    initialiser,
    integer_type,
    parameter_view,
    read_integer,
    size_assertion,
    write_integer,
    written,
)
from stagewire_generator.targets.c.framing import File, Framing, Tests
from stagewire_generator.targets.c.source import (
    EntryView,
    Names,
    call,
    definition,
    integer,
    message_doc,
    names_of,
    string,
)
from stagewire_generator.targets.vectors.subject import Subject

HEADER_SIZE = 6


class HeaderLayoutView(NamedTuple):
    """A layout of a message.

    :param type: the struct, and the prefix of its functions.
    :param initial: the definition of its initialiser.
    :param assertion: the assertion on the size of the struct; empty without a packet.
    :param write: the head of the function that writes its fields.
    :param written: the statements that write the fields.
    :param framed: the statement that writes the frame.
    :param checked: the expression that checks that bytes are a frame of this layout.
    :param encode: the head of the encoder with range checks.
    :param refused: the conditions for values out of range.
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
    array: ArrayView | None = None


@dataclass(frozen=True, slots=True)
class ArrayView:
    """The array at the end of a layout.

    :param member: its member of the struct.
    :param item: type of an integer.
    :param head: the id, and above it the length of the packet without the array.
    :param longest: length of the longest packet.
    :param count_head: the head of the function that counts the integers.
    :param count: the expression for the number of integers that the struct states.
    :param size_head: the head of the function that returns the length of the frame.
    :param stated: the expression for the length of the packet that a frame states.
    :param outside: the condition for an integer out of range; empty if the format has no other values.
    :param get: the expression that reads an integer.
    :param put: the statement that writes an integer.
    """

    member: str
    item: str
    size: int
    id: str
    head: str
    longest: int
    count_head: str
    count: str
    size_head: str
    stated: str
    outside: str
    get: str
    put: str


class HeaderMessageView(NamedTuple):
    """A message: its id and its layouts.

    :param doc: the comment of a message without layouts.
    :param aliases: the definitions of its other names.
    :param sub_message: its sub-message as a literal; empty if it has none.
    """

    name: str
    macro: str
    id: str
    doc: str
    layouts: tuple[HeaderLayoutView, ...]
    aliases: tuple[str, ...]
    sub_message: str


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
        aliases=tuple(_aliases(names, message)),
        sub_message=_sub_message(message),
    )


def _sub_message(message: Message) -> str:
    return "" if message.sub_message is None else f"{message.sub_message}U"


_OF_TYPE = ("", "_write_fields", "_encode", "_encode_unchecked", "_decode")
_OF_MACRO = ("_LENGTH", "_SIZE", "_INIT")
_OF_ARRAYS = ("_count", "_size", "_stated", "_at", "_put")


def _aliases(names: Names, message: Message) -> Iterator[str]:
    """Yield the definition of each other name of the message, its types, functions and macros."""
    for alias in message.aliases:
        for part in ("ID", "SUB_MESSAGE") if message.sub_message is not None else ("ID",):
            yield _define(f"{names.macro(alias)}_{part}", f"{names.macro(message.name)}_{part}")
    for alias, name in c_aliases(message):
        of, to = (f"{names.prefix}_{each}" for each in (alias, name))
        arrays = any(layout.array for layout in message.layouts)
        types = (*_OF_TYPE, *(_OF_ARRAYS if arrays else ()))
        macros = (*_OF_MACRO, *(["_LONGEST"] if arrays else []))
        yield from (_define(of + part, to + part) for part in types)
        yield from (_define(of.upper() + part, to.upper() + part) for part in macros)


def _define(name: str, meaning: str) -> str:
    """Return the definition of a macro, on two lines if it is long."""
    whole = f"#define {name} {meaning}"
    return whole if len(whole) <= 100 else f"#define {name} \\\n    {meaning}"


def _layout(names: Names, protocol: Protocol, message: Message, layout: Layout) -> HeaderLayoutView:
    assert message.id is not None
    type, prefix = names.layout(message, layout), names.prefix
    fields, head = _fields(names, layout), _head(layout, message.id)
    array = _array(names, message, layout)
    kind = "header" if layout.form == "header" else "packet"
    status, to = f"static inline {prefix}_status", [f"const {type} *message"]
    to += [f"{prefix}_addresses addresses", "uint8_t *out", "size_t cap"]
    size = f"{layout.length} bytes of data" if layout.length else "header only"
    begun = f"{prefix}_begin_{kind}({head}, addresses, out)"
    if array:
        size = f"{layout.length} to {array.longest} bytes of data"
        begun = f"{prefix}_begin_array({array.id}, {type}_size(message), addresses, out)"
    checked = f"{prefix}_check_{kind}(frame, size, {head})"
    if value := _sub_message(message):
        before = len(f"const {prefix}_status status = ")
        parts = [checked, "frame", value]
        checked = call(f"{prefix}_check_sub_message", parts, "", 4, before + len(";"))
    return HeaderLayoutView(
        type=type,
        macro=type.upper(),
        doc=message_doc(names, protocol, message, layout, size),
        length=layout.length,
        size=HEADER_SIZE + layout.length,
        assertion=size_assertion(names, layout, type) if layout.length else "",
        fields=fields,
        written=written(fields, fields[0].offset),
        framed=call(f"{type}_write_fields", ["message", begun], ";", 4),
        checked=checked,
        initial=definition(f"{type.upper()}_INIT", initialiser(names, fields)),
        refused=tuple(condition for field in fields for condition in field.refused),
        write=call(
            f"static inline void {type}_write_fields", [f"const {type} *message", "uint8_t *out"]
        ),
        array=array,
        encode=call(f"{status} {type}_encode", to),
        encode_unchecked=call(f"{status} {type}_encode_unchecked", to),
        decode=call(
            f"{status} {type}_decode", ["const uint8_t *frame", "size_t size", f"{type} *message"]
        ),
    )


def _array(names: Names, message: Message, layout: Layout) -> ArrayView | None:
    array = layout.array
    if array is None:
        return None
    field, item, size = layout.fields[-1], array.item, array.item.size
    type, struct = integer_type(item), names.layout(message, layout)
    message_of = [f"const {struct} *message"]
    assert message.id is not None
    outside = []
    if field.minimum > item.minimum:
        outside.append(f"value < {integer(field.minimum, size, item.signed)}")
    if field.maximum < item.maximum:
        outside.append(f"value > {integer(field.maximum, size, item.signed)}")
    at = f"bytes[index * {size}U]" if size > 1 else "bytes[index]"
    return ArrayView(
        member=field.name,
        item=type,
        size=size,
        id=f"0x{message.id:04X}U",
        head=_head(layout, message.id),
        longest=layout.longest,
        count_head=call(f"static inline size_t {struct}_count", message_of),
        size_head=call(f"static inline size_t {struct}_size", message_of),
        count=_count(names, layout, {name: f"message->{name}" for name in array.fields}),
        stated=_stated(names, layout),
        outside=" || ".join(outside),
        get=read_integer(names, item, f"&array->{at}"),
        put=write_integer(names, item, f"&{at}", "value"),
    )


def _count(names: Names, layout: Layout, values: Mapping[str, str]) -> str:
    """Return the expression for the number of integers in an array."""
    array = layout.array
    assert array is not None
    width = [f"{array.single}U"] if array.single else []
    width += [f"{names.prefix}_bits({values[name]})" for name in array.masks]
    each = " + ".join(width)
    return f"(size_t){values[array.rows]} * ({each})"


def _stated(names: Names, layout: Layout) -> str:
    """Return the expression for the length of the packet that a frame states."""
    array = layout.array
    assert array is not None
    values = {
        f.name: read_integer(names, f.format, f"&frame[{HEADER_SIZE + f.offset}]")
        if f.format.size > 1
        else f"frame[{HEADER_SIZE + f.offset}]"
        for f in layout.fields
        if f.name in array.fields
    }
    return f"{layout.length}U + {_count(names, layout, values)} * {array.item.size}U"


def _head(layout: Layout, id: int) -> str:
    """Return the first four bytes of a header as a number: the id, and above it the length of a packet."""
    if layout.form == "header":
        return f"0x{id:04X}U"
    return f"UINT32_C(0x{layout.length << 16 | id:08X})"


def _fields(names: Names, layout: Layout) -> tuple[FieldView, ...]:
    """Return the fields of a layout; for a header form its two parameters, including unused ones."""
    fields = []
    if layout.form == "header":
        parameters = ("param1", layout.param1), ("param2", layout.param2)
        for offset, (name, field) in enumerate(parameters, 2):
            fields.append(
                field_view(names, field, offset) if field else parameter_view(name, offset)
            )
    fields += [field_view(names, field, HEADER_SIZE + field.offset) for field in layout.fields]
    return tuple(fields)


_DIRECTIONS = {"to_host": "TO_HOST", "to_controller": "TO_CONTROLLER", "both": "TO_BOTH"}


class HeaderParserView(NamedTuple):
    """The table, and the addresses of devices.

    :param entries: rows sorted by id, then by length; an id with several lengths has several rows.
    :param shared: rows of ids that several messages share, sorted by id, sub-message and length.
    :param sub_messages: the sub-message of each of these rows.
    :param has_several: whether there is an id with several lengths.
    :param arrays: the arrays at the end of packets.
    :param devices: conditions on ``address``; one of them holds for a device.
    """

    entries: tuple[EntryView, ...]
    shared: tuple[EntryView, ...]
    sub_messages: tuple[str, ...]
    has_several: bool
    arrays: tuple[ArrayView, ...]
    devices: tuple[str, ...]

    def alike(self, *attributes: str) -> list[list[ArrayView]]:
        """Return the arrays in groups with equal attributes."""
        groups: dict[tuple[object, ...], list[ArrayView]] = {}
        for array in self.arrays:
            key = tuple(getattr(array, attribute) for attribute in attributes)
            groups.setdefault(key, []).append(array)
        return list(groups.values())


def header_parser_view(protocol: Protocol) -> HeaderParserView:
    """Make the view of the parser and its table."""
    prefix = names_of(protocol).macro_prefix
    messages = [message for message in protocol.messages if message.id is not None]
    shared = [message for message in messages if message.sub_message is not None]
    first = {message.id: message for message in reversed(messages)}  # of each id
    return HeaderParserView(
        entries=tuple(
            entry
            for message in reversed(first.values())
            for entry in _main_entries(prefix, message)
        ),
        shared=tuple(entry for message in shared for entry in _entries(prefix, message)),
        sub_messages=tuple(_sub_message(message) for message in shared for _ in _lengths(message)),
        arrays=tuple(_arrays(names_of(protocol), messages)),
        has_several=any(len(_lengths(message)) > 1 for message in messages),
        devices=tuple(_conditions(protocol.framing["devices"])),
    )


def _arrays(names: Names, messages: Iterable[Message]) -> Iterator[ArrayView]:
    """Yield the arrays at the end of packets."""
    for message in messages:
        for layout in message.layouts:
            if array := _array(names, message, layout):
                yield array


def _main_entries(prefix: str, message: Message) -> Iterator[EntryView]:
    """Yield the rows of an id; a shared id has one, which refers to the rows of its sub-messages."""
    if message.sub_message is None:
        yield from _entries(prefix, message)
        return
    forms = f"{prefix}_ENTRY_{_DIRECTIONS[message.direction]} | {prefix}_ENTRY_SHARED"
    yield EntryView(f"{{0x{message.id:04X}U, 0U, {forms}}}", "NULL")


def _entries(prefix: str, message: Message) -> Iterator[EntryView]:
    """Yield the rows of a message, which are adjacent in the table."""
    forms = list(_forms(message))
    for length in _lengths(message):
        words = " | ".join(f"{prefix}_ENTRY_{form}" for form in forms)
        code = f"{{0x{message.id:04X}U, {length}U, {words}}}"
        yield EntryView(code, string(message.name))
        if "SHORTER" not in forms:
            forms.append("SHORTER")


def _forms(message: Message) -> Iterator[str]:
    """Yield the flags of the first row of a message."""
    if not message.documented:  # its direction does not matter
        yield "UNDOCUMENTED"
        return
    yield _DIRECTIONS[message.direction]
    headers = [layout for layout in message.layouts if layout.form == "header"]
    if headers:
        yield "HEADER"
    if any(layout.only_zero for layout in headers):
        yield "ONLY_ZERO"
    if any(layout.array for layout in message.layouts):
        yield "ARRAY"


def _lengths(message: Message) -> list[int]:
    """Return the lengths of the packets of a message, sorted; only 0 if it has none."""
    return sorted({layout.length for layout in message.layouts if layout.form != "header"}) or [0]


def _conditions(addresses: Iterable[int]) -> Iterator[str]:
    """Yield a condition for each run of addresses without a gap."""
    runs: list[list[int]] = []
    for address in sorted(addresses):
        if runs and address == runs[-1][-1] + 1:
            runs[-1].append(address)
        else:
            runs.append([address])
    for run in runs:
        first, last = f"0x{run[0]:02X}U", f"0x{run[-1]:02X}U"
        if first == last:
            yield f"address == {first}"
        elif run[0] == 0:  # unsigned numbers are never negative
            yield f"address <= {last}"
        else:
            yield f"(address >= {first} && address <= {last})"


@lru_cache(maxsize=2)
def _by_id(protocol: Protocol, every: tuple[Subject, ...]) -> dict[int, list[Subject]]:
    """Return id -> layouts, for all messages with an id."""
    found: dict[int, list[Subject]] = {m.id: [] for m in protocol.messages if m.id is not None}
    for of in every:
        found[of.message.id or 0].append(of)
    return found


def _meant(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the layouts of the id, and of its sub-message, in the bytes.

    If the sub-message is missing or unknown, return those of the id; if that is, return all.
    """
    found = _by_id(protocol, every).get(int.from_bytes(raw[:2], "little"))
    if len(raw) < 2 or found is None:
        return every
    value = sub_message_of(raw) if len(raw) >= HEADER_SIZE else None
    return [of for of in found if of.message.sub_message in (None, value)] or found


FRAMING = Framing(
    message="header_message.h.j2",
    message_view=header_message_view,
    testee="header_testee.c.j2",
    files=(
        File("wire.h", "header_wire.h.j2", included=True),
        File("parser.h", "header_parser.h.j2", included=True),
        File("{package}.c", "header_parser.c.j2", header_parser_view),
    ),
    tests=Tests(
        calls="header_calls.c.j2",
        cut="header_cut.c.j2",
        trip="header_trip.c.j2",
        trip_needs="header_trip_needs.c.j2",
        data_at=lambda protocol, of: HEADER_SIZE,
        meant=_meant,
    ),
)

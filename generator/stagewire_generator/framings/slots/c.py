"""Commands, setup commands and replies in C: a type and its functions for each, the parser, and the tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.c.field_view import FieldView, field_view, initialiser, written
from stagewire_generator.targets.c.framing import File, Framing, Tests
from stagewire_generator.targets.c.source import (
    EntryView,
    Names,
    call,
    comment,
    definition,
    markup_of,
    names_of,
    string,
)
from stagewire_generator.targets.documentation import (
    command_paragraphs,
    errata_of,
    erratum_text,
    sentence,
)
from stagewire_generator.targets.vectors.subject import Subject


def command_doc(names: Names, protocol: Protocol, message: Message, layout: Layout) -> str:
    """Return the comment on a command or a setup command."""
    markup, id = markup_of(names), f"0x{message.id:02X}"
    if message.kind == "setup":
        prefix = f"0x{protocol.framing['prefix']:02X}"
        facts = f"{message.name} ({prefix} {id}), to the controller, two bytes"
    else:
        data = f"{_bytes(layout.length)} of data" if layout.length else "no data"
        slot = "no size slot" if message.size is None else f"size {message.size}"
        facts = f"{message.name} ({id}), to the controller, {data}, {slot}"
    refused = f"{names.macro_prefix}_ALLOW_DUMMIES"
    dummy = f"A dummy function: refused unless {refused} is defined."
    return comment([
        *command_paragraphs(protocol, message, layout, markup, facts, dummy),
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, message.errata)),
    ])  # fmt: skip


def reply_doc(names: Names, protocol: Protocol, message: Message, layout: Layout) -> str:
    """Return the comment on a reply."""
    markup = markup_of(names)
    of_fields = [slug for field in layout.fields for slug in field.errata]
    return comment([
        f"Reply to {message.name}, to the host, {_bytes(layout.length)}.",
        "A reply has no frame. Its meaning depends on the command that was sent.",
        sentence(layout.note) if layout.note else "",
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, of_fields)),
    ])  # fmt: skip


def _bytes(number: int) -> str:
    return f"{number} byte{'s' if number > 1 else ''}"


SLOTS = 3
"""Number of slots before the data of a command: axis, command byte, size."""


class SlotsLayoutView(NamedTuple):
    """A command, a setup command or a reply.

    :param type: the struct, and the prefix of its functions.
    :param length: length of the data in bytes.
    :param size: length in bytes, in the form that the document prints.
    :param refused: the conditions for values out of range.
    :param terminator_at: offset of the terminator.
    """

    type: str
    macro: str
    doc: str
    length: int
    size: int
    fields: tuple[FieldView, ...]
    written: tuple[str, ...]
    initial: str
    refused: tuple[str, ...]
    encode: str
    encode_unchecked: str
    decode: str
    terminator_at: int = 0


class SlotsMessageView(NamedTuple):
    """A command with its reply, or a setup command.

    :param kind: ``command`` or ``setup``.
    :param id_macro: the name of the macro of its command byte.
    :param head: command byte, size slot and length of the data as one number.
    :param sized: whether the document prints it with its size slot.
    """

    kind: str
    id_macro: str
    id: str
    size_slot: int
    head: str
    sized: bool
    dummy: bool
    request: SlotsLayoutView
    reply: SlotsLayoutView | None


def slots_message_view(protocol: Protocol, message: Message) -> SlotsMessageView:
    """Make the view of a command or a setup command."""
    assert message.id is not None
    names, layouts = names_of(protocol), {layout.form: layout for layout in message.layouts}
    request, reply = layouts["request"], layouts.get("reply")
    size_slot = message.size or 0
    make = _setup if message.kind == "setup" else _command
    return SlotsMessageView(
        kind=message.kind,
        id_macro=f"{names.macro(message.name)}_ID",
        id=f"0x{message.id:02X}U",
        size_slot=size_slot,
        head=f"UINT32_C(0x{request.length << 16 | size_slot << 8 | message.id:06X})",
        sized=message.size is not None,
        dummy=message.dummy,
        request=make(names, protocol, message, request),
        reply=_reply(names, protocol, message, reply) if reply else None,
    )


def _command(names: Names, protocol: Protocol, message: Message, layout: Layout) -> SlotsLayoutView:
    size = SLOTS + layout.length + 1 if message.size is not None else SLOTS
    refused = f"!{names.prefix}_is_axis(axis)"
    doc = command_doc(names, protocol, message, layout)
    return _layout(names, message, layout, doc, size, SLOTS, ["uint8_t axis"], (refused,))


def _setup(names: Names, protocol: Protocol, message: Message, layout: Layout) -> SlotsLayoutView:
    doc = command_doc(names, protocol, message, layout)
    return _layout(names, message, layout, doc, 2, 2, [], ())


def _reply(names: Names, protocol: Protocol, message: Message, layout: Layout) -> SlotsLayoutView:
    doc = reply_doc(names, protocol, message, layout)
    return _layout(names, message, layout, doc, layout.length, 0, [], ())


def _layout(
    names: Names,
    message: Message,
    layout: Layout,
    doc: str,
    size: int,
    data_at: int,
    receiver: list[str],
    refused: tuple[str, ...],
) -> SlotsLayoutView:
    """Make the view of a command, a setup command or a reply.

    :param size: its length in bytes.
    :param data_at: offset of the data.
    :param receiver: the parameter for the axis, or an empty list.
    :param refused: conditions for errors besides values of fields.
    """
    type = names.layout(message, layout)
    fields = tuple(
        field_view(names, field, data_at + field.offset, "bytes") for field in layout.fields
    )
    status = f"static inline {names.prefix}_status"
    content = [f"const {type} *message"] if fields else []
    to = [*content, *receiver, "uint8_t *out", "size_t cap"]
    into = [f"{type} *message"] if fields else []
    return SlotsLayoutView(
        type=type,
        macro=type.upper(),
        doc=doc,
        length=layout.length,
        size=size,
        fields=fields,
        written=written(fields),
        initial=definition(f"{type.upper()}_INIT", initialiser(names, fields)),
        refused=(*refused, *(condition for field in fields for condition in field.refused)),
        encode=call(f"{status} {type}_encode", to),
        encode_unchecked=call(f"{status} {type}_encode_unchecked", to),
        decode=call(f"{status} {type}_decode", ["const uint8_t *bytes", "size_t size", *into]),
        terminator_at=size - 1,
    )


class SlotsTableView(NamedTuple):
    """All commands.

    :param entries: commands sorted by their bytes, then setup commands.
    :param setup: bytes of the setup commands.
    :param longest_reply: its length; 1 if no command has a reply, since C has no empty arrays.
    """

    entries: tuple[EntryView, ...]
    setup: tuple[str, ...]
    longest_reply: int


def slots_table_view(protocol: Protocol) -> SlotsTableView:
    """Make the view of the table."""
    commands = [message for message in protocol.messages if message.kind == "command"]
    setup = [message for message in protocol.messages if message.kind == "setup"]
    return SlotsTableView(
        entries=tuple(_entry(protocol, message) for message in (*commands, *setup)),
        setup=tuple(_byte(message) for message in setup),
        longest_reply=max([1, *(_length(message, "reply") for message in commands)]),
    )


def _entry(protocol: Protocol, message: Message) -> EntryView:
    kind = f"{names_of(protocol).macro_prefix}_KIND_{message.kind.upper()}"
    lengths = [f"{_length(message, 'reply')}U", _byte(message), kind]
    lengths += [f"{message.size or 0}U", f"{_length(message, 'request')}U"]
    return EntryView(code=f"{{{', '.join(lengths)}}}", name=string(message.name))


def _byte(message: Message) -> str:
    return f"0x{message.id:02X}U"


def _length(message: Message, form: str) -> int:
    """Return the length of a request or a reply; 0 if there is none."""
    return sum(layout.length for layout in message.layouts if layout.form == form)


def _form(said: Json) -> str:
    """Return the form without its suffix for the size slot."""
    form, _, _ = str(said.get("form", "")).partition(":")
    return form or ("reply" if said.get("direction") == "reply" else "request")


def _envelope(of: Subject, said: Json) -> list[str]:
    """Return the member for the size slot if it is not as printed."""
    slots = {"with_size": "STAGEWIRE_SLOT_GIVEN", "without_size": "STAGEWIRE_SLOT_LEFT_OUT"}
    slot = slots.get(str(said.get("form", "")).partition(":")[2])
    return [f".size_slot = {slot}"] if slot else []


def _meant(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the reply to the given command, or the command with the byte."""
    if said.get("direction") == "reply":
        asked = said.get("command", "")
        return [of for of in every if of.message.name == asked and of.layout.form == "reply"]
    kind = "setup" if raw[:1] == bytes((protocol.framing["prefix"],)) else "command"
    key = kind, *raw[1:2]
    requests = [of for of in every if of.layout.form == "request"]
    return [of for of in requests if (of.message.kind, of.message.id) == key] or every


FRAMING = Framing(
    message="slots_message.h.j2",
    message_view=slots_message_view,
    testee="slots_testee.c.j2",
    files=(
        File("wire.h", "slots_wire.h.j2", slots_table_view, included=True),
        File("parser.h", "slots_parser.h.j2", included=True),
        File("replies.h", "slots_replies.h.j2", included=True),
        File("{package}.c", "slots_parser.c.j2", slots_table_view),
    ),
    tests=Tests(
        calls="slots_calls.c.j2",
        cut="testing_cut.c.j2",
        trip="slots_trip.c.j2",
        trip_needs="slots_trip_needs.c.j2",
        data_at=lambda protocol, of: 0 if of.layout.form == "reply" else SLOTS,
        form=_form,
        envelope=_envelope,
        meant=_meant,
    ),
)

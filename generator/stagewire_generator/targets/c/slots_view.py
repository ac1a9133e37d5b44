"""Commands, setup commands and replies: a type and its accessors each."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.targets.c.field_view import FieldView, field_view, initialiser, written
from stagewire_generator.targets.c.names import Names, names_of
from stagewire_generator.targets.c.slots_documentation import command_doc, reply_doc
from stagewire_generator.targets.c.source import call, definition

__all__ = ["SLOTS", "SlotsLayoutView", "SlotsMessageView", "slots_message_view"]

SLOTS = 3
"""Slots before the data of a command: axis, byte, size."""


@dataclass(frozen=True, slots=True)
class SlotsLayoutView:
    """A command, a setup command or a reply.

    :param type: the struct, and what its functions begin with.
    :param length: bytes of data.
    :param size: bytes of the whole, as the document prints it.
    :param refused: what the function that checks refuses, conditions.
    :param terminator_at: where the terminator stands.
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


@dataclass(frozen=True, slots=True)
class SlotsMessageView:
    """A command with its reply, or a setup command.

    :param kind: ``command`` or ``setup``.
    :param id_macro: the name of the macro of its byte.
    :param head: byte, size slot and length of data as one number.
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
    """Make the view of a command or of a setup command."""
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
    """Make the view of anything.

    :param size: bytes of the whole.
    :param data_at: where its data begins.
    :param receiver: the parameter that says for whom it is.
    :param refused: what is refused beside values of fields.
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

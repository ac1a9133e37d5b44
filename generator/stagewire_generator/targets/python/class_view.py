"""The view of a message class, for all framings."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.brackets import Nested, Source, call, mapping, strings
from stagewire_generator.targets.python.field_view import (
    FieldView,
    Slot,
    code,
    default,
    field_view,
    given_type,
    is_optional,
    name_of,
    packed,
    type_of,
)
from stagewire_generator.targets.python.source import literal, message_doc


class SharedView(NamedTuple):
    """A field that all candidate layouts of an undecided payload share; becomes a property."""

    name: str
    type: str
    wire_type: str  # type of the unpacked value
    format: str  # struct format of the field alone
    offset: int
    returned: Source  # expression that turns the unpacked value into the property's


class ClassView(NamedTuple):
    """One message class."""

    name: str
    kind: str  # name of the template
    base: str  # base class
    doc: str
    layout: Nested  # the call that creates its Layout
    # Classes with named fields only
    parameters: tuple[str, ...] = ()  # of the constructor; optional ones follow a star
    fields: tuple[FieldView, ...] = ()
    packer: str = ""  # name of the Struct that packs a message
    sent_format: str = ""  # its format
    read_format: str = ""  # format of the Struct that unpacks the fields
    packed: tuple[Source, ...] = ()  # arguments of the packing Struct
    # Classes with an array only
    counted: Source = ""  # the call that creates its Counted
    checked: Source = ""  # the call that checks its array
    # Undecided classes only
    shared: tuple[SharedView, ...] = ()
    # Commands only
    reply: str = ""  # class of the reply, or None
    # Classes whose bytes are only their fields: words for the docstrings of their methods
    noun: str = ""
    unpacked_from: str = ""
    packed_into: str = ""


def packer_name(class_name: str) -> str:
    """Return the name of the Struct of a class, a constant of its module."""
    return "_" + re.sub("(?<=.)(?=[A-Z])", "_", class_name).upper()


def parameters(slots: Sequence[Slot]) -> tuple[str, ...]:
    """Return the parameters of ``__new__``; optional ones are keyword-only."""
    required = [f"{name_of(s)}: {given_type(s)}" for s in slots if not is_optional(s)]
    optional = [f"{name_of(s)}: {type_of(s)} = {default(s)}" for s in slots if is_optional(s)]
    return ("cls", *required, *(["*", *optional] if optional else []))


def layout_call(
    message: str,
    id: str,
    direction: str,
    form: str,
    slots: Sequence[Slot],
    more: Sequence[Source] = (),
) -> Nested:
    """Return the call that creates the Layout of a class.

    :param more: arguments that do not follow from the slots.
    """
    names = [name_of(slot) for slot in slots]
    arguments: list[Source] = [
        literal(message),
        f"id={id}",
        f"direction=Direction.{direction.upper()}",
        f"form={literal(form)}",
        strings("fields=", names),
    ]
    taken = sum(slot.format.size for slot in slots if isinstance(slot, Field))
    if form != "header" and taken:
        arguments.append(f"length={taken}")
    formats = {s.name: s.format for s in slots if isinstance(s, Field)}
    lists = {
        "optional": [name_of(slot) for slot in slots if is_optional(slot)],
        "unnamed": [name for name in names if name in ("param1", "param2")],
    }
    arguments += [strings(f"{key}=", listed) for key, listed in lists.items() if listed]
    constants = {s.name: s.constant for s in slots if isinstance(s, Field) and s.constant}
    if constants:
        pairs = [f"{literal(k)}: {v}" for k, v in constants.items()]
        arguments.append(mapping("constants=", pairs))
    signed = [name for name, f in formats.items() if f.is_odd and f.signed]
    if signed:
        arguments.append(strings("signed=", signed))
    return call("Layout", [*arguments, *more], broken=True)


def payload_view(
    name: str, base: str, doc: str, made: Nested, layout: Layout, words: tuple[str, str, str]
) -> ClassView:
    """Return the view of a class whose bytes are only its fields.

    :param made: the call that creates its Layout.
    :param words: words for docstrings: its name, the source of unpacking, the result of packing.
    """
    format = f"<{''.join(code(field) for field in layout.fields)}"
    noun, read_from, packed_into = words
    return ClassView(
        name=name,
        kind="payload",
        base=base,
        doc=doc,
        layout=made,
        parameters=parameters(layout.fields),
        fields=tuple(field_view(field) for field in layout.fields),
        packer=packer_name(name),
        sent_format=format,
        read_format=format,
        packed=tuple(packed(field) for field in layout.fields),
        noun=noun,
        unpacked_from=read_from,
        packed_into=packed_into,
    )


def payload_views(protocol: Protocol, message: Message, base: str) -> list[ClassView]:
    """Make the views of all classes of a message that is a payload, one per length."""
    names = message_classes(message)
    return [
        _with_fields(protocol, message, layout, names[layout.form], base)
        if layout.fields
        else _empty(protocol, message, layout, names[layout.form], base)
        for layout in message.layouts
    ]


def _empty(protocol: Protocol, message: Message, layout: Layout, name: str, base: str) -> ClassView:
    return ClassView(
        name=name,
        kind="empty",
        base=base,
        doc=_doc(protocol, message, layout),
        layout=_layout(protocol, message, layout),
    )


def _with_fields(
    protocol: Protocol, message: Message, layout: Layout, name: str, base: str
) -> ClassView:
    doc, made = _doc(protocol, message, layout), _layout(protocol, message, layout)
    words = ("message", "the bytes of a payload", "the bytes of the payload")
    return payload_view(name, base, doc, made, layout, words)


def _layout(protocol: Protocol, message: Message, layout: Layout) -> Nested:
    id = _id(protocol, message)
    return layout_call(message.name, id, message.direction, layout.form, layout.fields)


def _id(protocol: Protocol, message: Message) -> str:
    assert message.id is not None
    return f"0x{message.id:0{protocol.id_digits}X}"


def _doc(protocol: Protocol, message: Message, layout: Layout) -> str:
    size = f"{layout.length} byte{'s' * (layout.length > 1)} of payload"
    named = f"``{message.name}`` ({_id(protocol, message)})"
    return message_doc(protocol, message, layout, named, size if layout.length else "no payload")

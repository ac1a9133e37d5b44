"""What the template of a message class needs, whatever the framing of its protocol."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_generator.model import Field, Layout, Message, Protocol
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.field_view import (
    FieldView,
    Slot,
    code,
    default,
    field_view,
    is_optional,
    name_of,
    packed,
)
from stagewire_generator.targets.python.source import (
    WIDTH,
    bracketed,
    call,
    literal,
    message_doc,
    tuple_of,
)


@dataclass(frozen=True, slots=True)
class SharedView:
    """One field that all candidates of an undecided payload share, as a property."""

    name: str
    type: str
    wire_type: str  # type of the unpacked value
    format: str  # struct format of the field alone
    offset: int
    returned: str  # expression that turns the unpacked value into the property's


@dataclass(frozen=True, slots=True)
class ClassView:
    """One message class."""

    name: str
    kind: str  # names the template
    base: str  # the class that it is made from
    doc: str
    slots: str
    layout: str
    # Classes with named fields only
    signature: str = ""
    fields: tuple[FieldView, ...] = ()
    packer: str = ""  # the statement that makes the Struct of what is sent
    unpacker: str = ""  # the statement that makes the method that reads the fields from it
    unpack: str = ""  # the assignment
    pack: str = ""  # the return statement
    # Undecided classes only
    shared: tuple[SharedView, ...] = ()
    shared_names: str = ""
    # Commands only
    reply: str = ""  # class of the reply, or None
    # Classes whose bytes are their fields and nothing else: what the docstrings of their methods say
    noun: str = ""
    unpacked: str = ""
    packed: str = ""


def packer_name(class_name: str) -> str:
    """Return the name of the Struct of a class, as a constant of its module."""
    return "_" + re.sub("(?<=.)(?=[A-Z])", "_", class_name).upper()


def names_line(head: str, names: list[str]) -> str:
    """Return the assignment of a tuple of names in the body of a class."""
    quoted = [literal(name) for name in names]
    return call(head, quoted, "", 4) if len(quoted) > 1 else head + tuple_of(quoted)


def constructor(slots: Sequence[Slot], fields: Sequence[FieldView]) -> str:
    """Return the signature of ``__new__``; what may be left out is a keyword."""
    pairs = list(zip(fields, slots, strict=True))
    arguments = ["cls", *(f"{f.name}: {f.type}" for f, s in pairs if not is_optional(s))]
    optional = [f"{f.name}: {f.type} = {default(s)}" for f, s in pairs if is_optional(s)]
    if optional:
        arguments += ["*", *optional]
    return call("def __new__", arguments, " -> Self:", 4)


def assignment(fields: Sequence[FieldView]) -> str:
    """Return the assignment that unpacks all fields."""
    targets = [f.name if f.unpacked else f"draft.{f.name}" for f in fields]
    right = "cls._unpack(raw)"
    if len(targets) == 1:
        return f"({targets[0]},) = {right}"
    line = f"{', '.join(targets)} = {right}"
    return line if len(line) + 8 <= WIDTH else bracketed("(", targets, f") = {right}", 8, 0)


def layout_call(
    message: str, id: str, direction: str, form: str, slots: Sequence[Slot], more: Sequence[str]
) -> str:
    """Return the statement that makes the Layout of a class.

    :param more: arguments beyond those that follow from the slots.
    """
    names = [name_of(slot) for slot in slots]
    arguments = [
        literal(message),
        f"id={id}",
        f"direction=Direction.{direction.upper()}",
        f"form={literal(form)}",
        _names("fields=", [literal(n) for n in names]),
    ]
    taken = sum(slot.format.size for slot in slots if isinstance(slot, Field))
    if form != "header" and taken:
        arguments.append(f"length={taken}")
    optional = [literal(name_of(slot)) for slot in slots if is_optional(slot)]
    if optional:
        arguments.append(_names("optional=", optional))
    unnamed = [literal(n) for n in names if n in ("param1", "param2")]
    if unnamed:
        arguments.append(f"unnamed={tuple_of(unnamed)}")
    constants = {s.name: s.constant for s in slots if isinstance(s, Field) and s.constant}
    if constants:
        pairs = [f"{literal(k)}: {v}" for k, v in constants.items()]
        arguments.append(bracketed("constants={", pairs, "}", 8, WIDTH - 1))
    formats = {s.name: s.format for s in slots if isinstance(s, Field)}
    signed = [literal(name) for name, f in formats.items() if f.is_odd and f.signed]
    if signed:
        arguments.append(_names("signed=", signed))
    return call("layout = Layout", [*arguments, *more], "", 4, 0)


def _names(head: str, quoted: list[str]) -> str:
    """Return a keyword argument of the Layout that is a tuple of names."""
    return call(head, quoted, "", 8, WIDTH - 1) if len(quoted) > 1 else head + tuple_of(quoted)


def payload_view(
    name: str, base: str, doc: str, made: str, layout: Layout, words: tuple[str, str, str]
) -> ClassView:
    """Return the view of a class that is its fields and nothing around them.

    :param made: the statement that makes its Layout.
    :param words: what it is called, and what it is read from and packed into.
    """
    fields = tuple(field_view(field) for field in layout.fields)
    format = f'"<{"".join(code(field) for field in layout.fields)}"'
    packer = packer_name(name)
    noun, read_from, packed_into = words
    return ClassView(
        name=name,
        kind="payload",
        base=base,
        doc=doc,
        slots=names_line("__slots__ = ", sorted(field.name for field in fields)),
        layout=made,
        signature=constructor(layout.fields, fields),
        fields=fields,
        packer=call(f"{packer} = Struct", [format], "", 0),
        unpacker=call("_unpack = Struct", [format], ".unpack_from", 4),
        unpack=assignment(fields),
        pack=call(f"return {packer}.pack", [packed(field) for field in layout.fields], "", 8),
        noun=noun,
        unpacked=read_from,
        packed=packed_into,
    )


def payload_views(protocol: Protocol, message: Message, base: str) -> list[ClassView]:
    """Make the views of all classes of a message that is a payload, one for each length of it."""
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
        slots="__slots__ = ()",
        layout=_layout(protocol, message, layout),
    )


def _with_fields(
    protocol: Protocol, message: Message, layout: Layout, name: str, base: str
) -> ClassView:
    doc, made = _doc(protocol, message, layout), _layout(protocol, message, layout)
    words = ("message", "the bytes of a payload", "the bytes of the payload")
    return payload_view(name, base, doc, made, layout, words)


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

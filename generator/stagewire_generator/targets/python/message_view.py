"""Message classes: one view a class."""

from __future__ import annotations

import re
from dataclasses import dataclass

from stagewire_generator.model import Erratum, Field, Layout, Message, Protocol
from stagewire_generator.naming import camel, message_classes
from stagewire_generator.targets.python.source import (
    WIDTH,
    bracketed,
    call,
    docstring,
    integer,
    literal,
    paragraph,
    sentence,
    tuple_of,
)

__all__ = ["ClassView", "FieldView", "class_views"]

_CODES = {1: "b", 2: "h", 4: "l", 8: "q"}  # capitals without a sign
_TYPES = {"integer": "int", "text": "str", "bytes": "bytes"}
_DECODE = '.rstrip(b"\\0").decode'
_ROLES = {"set": "Set", "req": "Request", "get": "Report"}
_EXCHANGES = {"answered_by": "Answered by", "completes_with": "Completes with"}
_DIRECTIONS = {
    "to_controller": "to the controller",
    "to_host": "to the host",
    "both": "either way",
}


@dataclass(frozen=True, slots=True)
class FieldView:
    """One field as a slot, an argument, and a check."""

    name: str
    type: str
    check: str  # statement(s) that check and normalise the argument
    flags: str  # class of its flags, or ""
    unpacked: str  # expression that turns the unpacked value into the slot's, or ""


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
    kind: str  # plain | undecided | undocumented; names the template
    doc: str
    slots: str
    layout: str
    # Plain classes only
    signature: str = ""
    fields: tuple[FieldView, ...] = ()
    packer: str = ""  # the statement that makes the Struct of the whole frame
    unpacker: str = ""  # the statement that makes the method that reads the fields from it
    unpack: str = ""  # the assignment
    pack: str = ""  # the return statement
    # Undecided classes only
    shared: tuple[SharedView, ...] = ()
    shared_names: str = ""


def class_views(protocol: Protocol, message: Message) -> list[ClassView]:
    """Make the views of all classes that a message becomes."""
    if not message.documented:
        return [_undocumented(protocol, message)]
    names = message_classes(message)
    views = [_class(protocol, message, layout, names[layout.form]) for layout in message.layouts]
    contextual = [layout for layout in message.layouts if layout.when]
    if contextual:
        views.append(_undecided(protocol, message, contextual))
    return views


def _slots(message: Message, layout: Layout) -> list[Field | str]:
    """Return the fields of a class; a header parameter without a meaning is a bare name."""
    slots: list[Field | str] = []
    if layout.form == "header":
        for name, field in (("param1", layout.param1), ("param2", layout.param2)):
            slots.append(field or name)
    return [*slots, *layout.fields]


def _class(protocol: Protocol, message: Message, layout: Layout, name: str) -> ClassView:
    assert message.id is not None
    slots = _slots(message, layout)
    fields = tuple(_field(slot) for slot in slots)
    header = layout.form == "header"
    codes = "".join(_code(slot) for slot in slots)
    names = [field.name for field in fields]
    required = [f for f, s in zip(fields, slots, strict=True) if not _optional(s)]
    optional = [(f, s) for f, s in zip(fields, slots, strict=True) if _optional(s)]
    arguments = ["cls", *(f"{f.name}: {f.type}" for f in required)]
    if optional:
        arguments.append("*")
        arguments += [f"{f.name}: {f.type} = {_default(s)}" for f, s in optional]
    payload = f"<2x{codes}2x" if header else f"<6x{codes}"
    frame = f"<H{codes}BB" if header else f"<LBB{codes}"
    packer = "_" + re.sub("(?<=.)(?=[A-Z])", "_", name).upper()
    targets = [f.name if f.unpacked else f"draft.{f.name}" for f in fields]
    packed = [_packed(slot) for slot in slots]
    id = f"0x{message.id:04X}"
    if header:
        values = [id, *packed, "dest", "source"]
    else:
        values = [f"{layout.length} << 16 | {id}", "dest | 0x80", "source", *packed]
    return ClassView(
        name=name,
        kind="plain",
        doc=_doc(protocol, message, layout),
        slots=_names("__slots__ = ", sorted(names)),
        layout=_layout(message, layout, slots),
        signature=call("def __new__", arguments, " -> Self:", 4),
        fields=fields,
        packer=call(f"{packer} = Struct", [f'"{frame}"'], "", 0),
        unpacker=call("_unpack = Struct", [f'"{payload}"'], ".unpack_from", 4),
        unpack=_assign(targets),
        pack=call(f"return {packer}.pack", values, "", 8),
    )


def _names(head: str, names: list[str]) -> str:
    """Return the assignment of a tuple of names in the body of a class."""
    quoted = [literal(name) for name in names]
    return call(head, quoted, "", 4) if len(quoted) > 1 else head + tuple_of(quoted)


def _assign(targets: list[str]) -> str:
    right = "cls._unpack(raw)"
    if len(targets) == 1:
        return f"({targets[0]},) = {right}"
    line = f"{', '.join(targets)} = {right}"
    return line if len(line) + 8 <= WIDTH else bracketed("(", targets, f") = {right}", 8, 0)


def _code(slot: Field | str) -> str:
    if isinstance(slot, str):
        return "B"
    if slot.format.kind != "integer":
        return f"{slot.format.size}s"
    code = _CODES[slot.format.size]
    return code if slot.format.signed else code.upper()


def _optional(slot: Field | str) -> bool:
    return isinstance(slot, str) or slot.role in ("reserved", "constant")


def _default(slot: Field | str) -> str:
    if isinstance(slot, str):
        return "0"
    if slot.format.kind == "text":
        return '""'
    if slot.format.kind == "bytes":
        return f"bytes({slot.format.size})"
    return integer(slot.constant or 0)


def _packed(slot: Field | str) -> str:
    if isinstance(slot, Field) and slot.format.kind == "text":
        return f'self.{slot.name}.encode("latin-1")'
    return f"self.{slot if isinstance(slot, str) else slot.name}"


def _field(slot: Field | str) -> FieldView:
    if isinstance(slot, str):
        return FieldView(slot, "int", _integer_check(slot, 0, 0xFF), "", "")
    name, format = slot.name, slot.format
    if format.kind == "text":
        arguments = ["cls.layout", literal(name), name, str(format.size)]
        check = call(f"{name} = check_text", arguments, "", 8)
        unpacked = call(f"draft.{name} = {name}{_DECODE}", ['"latin-1"'], "", 8)
        return FieldView(name, "str", check, "", unpacked)
    if format.kind == "bytes":
        arguments = ["cls.layout", literal(name), name, str(format.size)]
        check = call(f"{name} = check_bytes", arguments, "", 8)
        return FieldView(name, "bytes", check, "", "")
    flags = camel(slot.flags.name) if slot.flags else ""
    minimum, maximum = slot.minimum, slot.maximum
    return FieldView(name, "int", _integer_check(name, minimum, maximum), flags, "")


def _integer_check(name: str, minimum: int, maximum: int) -> str:
    low, high = integer(minimum), integer(maximum)
    test = f"if {name}.__class__ is not int or not {low} <= {name} <= {high}:"
    if len(test) > WIDTH - 8:
        pad = " " * 8
        test = (
            f"if (\n{pad}    {name}.__class__ is not int\n"
            f"{pad}    or not {low} <= {name} <= {high}\n{pad}):"
        )
    body = call(f"{name} = check_integer", ["cls.layout", f'"{name}"', name, low, high], "", 12)
    return f"{test}\n            {body}"


def _layout(message: Message, layout: Layout, slots: list[Field | str]) -> str:
    assert message.id is not None
    names = [slot if isinstance(slot, str) else slot.name for slot in slots]
    arguments = [
        literal(message.name),
        f"id=0x{message.id:04X}",
        f"direction=Direction.{message.direction.upper()}",
        f"form={literal(layout.form)}",
        f"fields={tuple_of([literal(n) for n in names])}",
    ]
    if len(arguments[-1]) > 90:
        arguments[-1] = call("fields=", [literal(n) for n in names], "", 8)
    if layout.length:
        arguments.append(f"length={layout.length}")
    optional = [n for n, s in zip(names, slots, strict=True) if _optional(s)]
    if optional:
        arguments.append(
            call("optional=", [literal(n) for n in optional], "", 8)
            if len(optional) > 1
            else f"optional={tuple_of([literal(n) for n in optional])}"
        )
    unnamed = [n for n in names if n in ("param1", "param2")]
    if unnamed:
        arguments.append(f"unnamed={tuple_of([literal(n) for n in unnamed])}")
    if layout.when:
        pairs = [f"{literal(k)}: {literal(v)}" for k, v in layout.when.items()]
        arguments.append(bracketed("when={", pairs, "}", 8, WIDTH - 1))
    constants = {s.name: s.constant for s in slots if isinstance(s, Field) and s.constant}
    if constants:
        pairs = [f"{literal(k)}: {v}" for k, v in constants.items()]
        arguments.append(bracketed("constants={", pairs, "}", 8, WIDTH - 1))
    if layout.only_zero:
        arguments.append("only_zero=True")
    return call("layout = Layout", arguments, "", 4, 0)


def _undocumented(protocol: Protocol, message: Message) -> ClassView:
    assert message.id is not None
    arguments = [
        literal(message.name),
        f"id=0x{message.id:04X}",
        f"direction=Direction.{message.direction.upper()}",
        'form="undocumented"',
        'fields=("data", "param1", "param2")',
        'optional=("param1", "param2")',
        'unnamed=("param1", "param2")',
    ]
    return ClassView(
        name=message.class_name,
        kind="undocumented",
        doc=_doc(protocol, message, None),
        slots="__slots__ = ()",
        layout=call("layout = Layout", arguments, "", 4, 0),
    )


def _undecided(protocol: Protocol, message: Message, layouts: list[Layout]) -> ClassView:
    assert message.id is not None
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
        f"id=0x{message.id:04X}",
        f"direction=Direction.{message.direction.upper()}",
        'form="data:undecided"',
        'fields=("data",)',
        f"length={first.length}",
    ]
    choices = " or ".join(f"{k} {v}" for layout in layouts for k, v in layout.when.items())
    text = (
        f"``{message.name}`` (0x{message.id:04X}) whose layout no context has decided; "
        f"page {message.pages[0]}.\n\n    "
        + paragraph(
            f"{message.summary} Bytes do not tell its layouts apart ({choices}). The fields that all of "
            "them share can be read; it encodes back from ``data`` alone.",
            4,
        )
    )
    views = tuple(
        SharedView(
            name=field.name,
            type=_TYPES[field.format.kind],
            wire_type="int" if field.format.kind == "integer" else "bytes",
            format=f"<{_code(field)}",
            offset=field.offset,
            returned=f'value{_DECODE}("latin-1")' if field.format.kind == "text" else "value",
        )
        for field in shared
    )
    return ClassView(
        name=message.class_name + "Undecided",
        kind="undecided",
        doc=docstring(text),
        slots="__slots__ = ()",
        layout=call("layout = Layout", arguments, "", 4, 0),
        shared=views,
        shared_names=_names("shared = ", [view.name for view in views]),
    )


def _doc(protocol: Protocol, message: Message, layout: Layout | None) -> str:
    assert message.id is not None
    size = "layout not documented"
    if layout is not None:
        size = f"{layout.length} bytes of data" if layout.length else "header only"
    pages = ", ".join(str(page) for page in message.pages)
    where = f"page{'s' if len(message.pages) > 1 else ''} {pages}"
    sent = _DIRECTIONS[message.direction]
    parts = [f"``{message.name}`` (0x{message.id:04X}), {sent}, {size}; {where}."]
    role = f"{_ROLES[message.set[1]]}: " if message.set else ""
    parts.append(paragraph(role + _lower(message.summary, role), 4))
    facts = []
    for key, text in _EXCHANGES.items():
        names = message.exchange.get(key)
        if names:
            facts.append(f"{text} {', '.join(f'``{name}``' for name in names)}.")
    if layout is not None and layout.when:
        choice = ", ".join(f"{k} {v}" for k, v in layout.when.items())
        facts.append(f"This layout: {choice}.")
    if facts:
        parts.append(paragraph(" ".join(facts), 4))
    for note in (message.note, layout.note if layout else ""):
        if note:
            parts.append(paragraph(sentence(note), 4))
    if layout is not None and layout.all_fields:
        lines = [paragraph(_param(field), 4, 4) for field in layout.all_fields]
        parts.append("\n    ".join(lines))
    errata = [e for e in protocol.errata if e.id in message.errata and e.kind != "cosmetic"]
    if errata:
        parts.append("\n    ".join(paragraph(_erratum(e), 4, 4) for e in errata))
    return docstring("\n\n    ".join(parts))


def _lower(text: str, role: str) -> str:
    """Return a summary as it continues after a role; an acronym keeps its capitals."""
    return text[:1].lower() + text[1:] if role and not text[1:2].isupper() else text


def _param(field: Field) -> str:
    facts = []
    if field.note:
        facts.append(field.note.rstrip("."))
    if field.role == "reserved":
        facts.append("reserved, sent as zero")
    if field.constant is not None:
        facts.append(f"always {field.constant:#04x}")
    if field.quantity:
        facts.append(_unit(field))
    if field.enum:
        facts.append(f":class:`~.{camel(field.enum.name)}`")
    if field.flags:
        facts.append(f":class:`~.{camel(field.flags.name)}`")
    if field.format.kind == "text":
        facts.append(f"text of at most {field.format.size} characters")
    elif field.format.kind == "bytes":
        facts.append(f"{field.format.size} bytes")
    else:
        facts.append(f"{field.minimum} to {field.maximum}")
    if field.default is not None:
        facts.append(f"by default {field.default}")
    return f":param {field.name}: {'; '.join(facts)}."


def _unit(field: Field) -> str:
    quantity = field.quantity
    assert quantity
    unit = quantity.unit or "unit by setting"
    if quantity.factor:
        factor = quantity.factor
        return f"raw counts of {unit}, {factor.key} {factor.value}"
    if "unknown" in quantity.rule:
        return f"raw counts of {unit}, scale unknown"
    by = quantity.rule.get("by")
    setting = quantity.rule.get("setting")
    return f"raw counts of {unit}, scale by {setting or by}"


def _erratum(erratum: Erratum) -> str:
    text = f"Erratum ``{erratum.id}``: printed {erratum.printed}; encoded {erratum.encoded}"
    return text if text.endswith(".") else text + "."

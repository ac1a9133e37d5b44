"""One field: how it is checked, packed and unpacked in generated code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from stagewire_generator.model import Field
from stagewire_generator.naming import camel
from stagewire_generator.targets.python.source import WIDTH, assigned, call, integer, literal

Slot: TypeAlias = Field | str
"""A field of a class; a header parameter without a meaning is a bare name."""

_CODES = {1: "b", 2: "h", 4: "l", 8: "q"}  # capitals without a sign
_TYPES = {"integer": "int", "text": "str", "bytes": "bytes"}


@dataclass(frozen=True, slots=True)
class FieldView:
    """One field as a slot, an argument, and a check."""

    name: str
    type: str
    check: str  # statement(s) that check and normalise the argument
    flags: str  # class of its flags, or ""
    filled: str  # statement that puts the argument into the slot
    unpacked: str  # statement that turns the unpacked value into the slot's, or ""


def field_view(slot: Slot) -> FieldView:
    """Make the view of a field."""
    if isinstance(slot, str):
        return FieldView(slot, "int", _integer_check(slot, 0, 0xFF), "", _filled(slot), "")
    name, kind = slot.name, slot.format.kind
    unpacked = value_of(slot, name, f"draft.{name} = ", 8) if is_converted(slot) else ""
    if kind != "integer":
        arguments = ["cls.layout", literal(name), name, str(slot.format.size)]
        check = call(f"{name} = check_{kind}", arguments, "", 8)
        return FieldView(name, _TYPES[kind], check, "", _filled(name), unpacked)
    flags = camel(slot.flags.name) if slot.flags else ""
    check = _integer_check(name, slot.minimum, slot.maximum)
    return FieldView(name, "int", check, flags, _filled(name), unpacked)


def _filled(name: str) -> str:
    return assigned(f"draft.{name}", name, 8)


def name_of(slot: Slot) -> str:
    """Return the name of a field."""
    return slot if isinstance(slot, str) else slot.name


def type_of(field: Field) -> str:
    """Return the type of a field's value."""
    return _TYPES[field.format.kind]


def code(slot: Slot) -> str:
    """Return the code of a field in the format of a Struct; it has none for integers of odd sizes."""
    if isinstance(slot, str):
        return "B"
    if slot.format.kind != "integer" or slot.format.is_odd:
        return f"{slot.format.size}s"
    letter = _CODES[slot.format.size]
    return letter if slot.format.signed else letter.upper()


def wire_type(field: Field) -> str:
    """Return the type of what a Struct unpacks for a field."""
    return "bytes" if code(field).endswith("s") else "int"


def is_optional(slot: Slot) -> bool:
    """Whether a field may be left out when a message is made."""
    return isinstance(slot, str) or slot.role in ("reserved", "constant")


def default(slot: Slot) -> str:
    """Return the value of a field that is left out."""
    if isinstance(slot, str):
        return "0"
    if slot.format.kind == "text":
        return '""'
    if slot.format.kind == "bytes":
        return f"bytes({slot.format.size})"
    return integer(slot.constant or 0)


def packed(slot: Slot) -> str:
    """Return the expression that a Struct packs, as an argument of a call in a method."""
    name = name_of(slot)
    if isinstance(slot, Field) and slot.format.kind == "text":
        return call(f"self.{name}.encode", ['"latin-1"'], "", 12, WIDTH - 1)
    if isinstance(slot, Field) and slot.format.is_odd:
        arguments = [str(slot.format.size), '"little"', *_sign(slot)]
        return call(f"self.{name}.to_bytes", arguments, "", 12, WIDTH - 1)
    return f"self.{name}"


def is_converted(field: Field) -> bool:
    """Whether what a Struct unpacks is not yet the value of the field."""
    return field.format.kind == "text" or field.format.is_odd


def value_of(field: Field, unpacked: str, head: str, indent: int) -> str:
    """Return ``head`` and the expression that turns what was unpacked into the value of the field."""
    if field.format.kind == "text":
        bare = f'{unpacked}.rstrip(b"\\0")'
        line = f'{head}{bare}.decode("latin-1")'
        if indent + len(line) <= WIDTH:
            return line
        return call(f"{head}str", [bare, '"latin-1"'], "", indent)  # breaks at a bracket of its own
    if field.format.is_odd:
        return call(f"{head}int.from_bytes", [unpacked, '"little"', *_sign(field)], "", indent)
    return head + unpacked


def _sign(field: Field) -> list[str]:
    return ["signed=True"] if field.format.signed else []


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

"""The view of a field: how generated code checks, packs and unpacks it."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from stagewire_generator.model_fields import Field, Format
from stagewire_generator.naming import camel
from stagewire_generator.targets.python.brackets import Preferred, Source, call
from stagewire_generator.targets.python.source import integer

Slot: TypeAlias = Field | str
"""A field of a class; an unused header parameter is a bare name."""

_CODES = {1: "b", 2: "h", 4: "l", 8: "q"}  # capitals without a sign
_TYPES = {"integer": "int", "text": "str", "bytes": "bytes", "array": "tuple[int, ...]"}
_GIVEN = {"array": "Iterable[int]"}  # types that a constructor accepts, if they are others


class FieldView(NamedTuple):
    """A field as a slot and as an argument of the constructor."""

    name: str
    kind: str  # integer, text or bytes
    type: str
    size: int = 0  # of a text or bytes
    minimum: str = ""  # of an integer
    maximum: str = ""
    flags: str = ""  # class of its flags
    value: Source = (
        ""  # expression that converts the unpacked value; empty if it needs no conversion
    )

    @property
    def target(self) -> str:
        """The variable for the unpacked value."""
        return self.name if self.value else f"draft.{self.name}"


def field_view(slot: Slot) -> FieldView:
    """Make the view of a field."""
    if isinstance(slot, str):
        return FieldView(slot, "integer", "int", minimum=integer(0), maximum=integer(0xFF))
    name, kind = slot.name, slot.format.kind
    if kind == "array":
        low, high = integer(slot.minimum), integer(slot.maximum)
        return FieldView(name, kind, _TYPES[kind], minimum=low, maximum=high)
    value = value_of(slot, name) if is_converted(slot) else ""
    if kind != "integer":
        return FieldView(name, kind, _TYPES[kind], slot.format.size, value=value)
    flags = camel(slot.flags.name) if slot.flags else ""
    low, high = integer(slot.minimum), integer(slot.maximum)
    return FieldView(name, kind, "int", minimum=low, maximum=high, flags=flags, value=value)


def name_of(slot: Slot) -> str:
    """Return the name of a field."""
    return slot if isinstance(slot, str) else slot.name


def type_of(slot: Slot) -> str:
    """Return the type of a field's value."""
    return "int" if isinstance(slot, str) else _TYPES[slot.format.kind]


def given_type(slot: Slot) -> str:
    """Return the type of the value that a constructor accepts."""
    return type_of(slot) if isinstance(slot, str) else _GIVEN.get(slot.format.kind, type_of(slot))


def integer_code(format: Format) -> str:
    """Return the format character of an integer for Struct."""
    letter = _CODES[format.size]
    return letter if format.signed else letter.upper()


def code(slot: Slot) -> str:
    """Return the format character of a field for Struct; integers of odd sizes are read as bytes."""
    if isinstance(slot, str):
        return "B"
    if slot.format.kind != "integer" or slot.format.is_odd:
        return f"{slot.format.size}s"
    return integer_code(slot.format)


def wire_type(field: Field) -> str:
    """Return the type of the value that Struct unpacks for a field."""
    return "bytes" if code(field).endswith("s") else "int"


def is_optional(slot: Slot) -> bool:
    """Whether a field may be left out when a message is created."""
    if isinstance(slot, str) or slot.role in ("reserved", "constant"):
        return True
    return slot.omitted is not None


def default(slot: Slot) -> str:
    """Return the default of an optional field."""
    if isinstance(slot, str):
        return "0"
    if slot.format.kind == "text":
        return '""'
    if slot.format.kind == "bytes":
        return f"bytes({slot.format.size})"
    return integer(slot.constant or slot.omitted or 0)


def packed(slot: Slot) -> Source:
    """Return the expression that is passed to Struct for packing."""
    name = name_of(slot)
    if isinstance(slot, Field) and slot.format.kind == "text":
        return call(f"self.{name}.encode", ['"latin-1"'])
    if isinstance(slot, Field) and slot.format.is_odd:
        return call(f"self.{name}.to_bytes", [str(slot.format.size), '"little"', *_sign(slot)])
    return f"self.{name}"


def is_converted(field: Field) -> bool:
    """Whether the value that Struct unpacks has to be converted."""
    return field.format.kind == "text" or field.format.is_odd


def value_of(field: Field, unpacked: str) -> Source:
    """Return the expression that converts an unpacked value into the value of the field."""
    if field.format.kind == "text":
        bare = f'{unpacked}.rstrip(b"\\0")'
        return Preferred(f'{bare}.decode("latin-1")', call("str", [bare, '"latin-1"']))
    if field.format.is_odd:
        return call("int.from_bytes", [unpacked, '"little"', *_sign(field)])
    return unpacked


def _sign(field: Field) -> list[str]:
    return ["signed=True"] if field.format.signed else []

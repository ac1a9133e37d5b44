"""The view of a field: its struct member, and how it is checked, written and read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from stagewire_generator.model import Layout
from stagewire_generator.model_fields import Field, Format
from stagewire_generator.targets.c.source import Names, bits_of, call, comment, field_doc, integer


class FieldView(NamedTuple):
    """A field.

    :param initial: its part of the initialiser.
    :param refused: conditions that hold for a value out of range; none if the type allows no such value.
    :param read: the statement that reads it from the bytes.
    :param offset: its offset in the bytes written.
    :param put: the function that writes it and returns the position of the next field.
    :param value: the arguments of this function after the position.
    :param byte: its value as a single byte; empty if it has several bytes.
    """

    name: str
    doc: str
    declaration: str
    initial: str
    refused: tuple[str, ...]
    read: str
    offset: int
    put: str
    value: str
    byte: str = ""


def field_view(names: Names, field: Field, offset: int, read_from: str = "frame") -> FieldView:
    """Make the view of a field.

    :param offset: its offset in the bytes.
    :param read_from: the variable with the bytes to read.
    """
    name, size = field.name, field.format.size
    source, value = f"&{read_from}[{offset}]", f"message->{name}"
    doc = field_doc(names, field)
    if field.array:
        return _array_view(names, field, offset, read_from)
    if field.format.kind != "integer":
        kind = "char" if field.format.kind == "text" else "uint8_t"
        return FieldView(
            name=name,
            doc=doc,
            declaration=f"{kind} {name}[{size}];",
            initial="{0}",
            refused=(),
            read=f"{names.prefix}_copy({value}, {size}U, {source});",
            offset=offset,
            put=f"{names.prefix}_put_bytes",
            value=f"{size}U, {value}",
        )
    unsigned, held = f"uint{bits_of(field)}_t", _type(field)
    taken = f"{read_from}[{offset}]" if size == 1 else f"{names.prefix}_get_{8 * size}({source})"
    if field.format.signed and field.format.is_odd:
        taken = f"{names.prefix}_signed_{8 * size}({taken})"
        unsigned = held
    wide = "uint64_t" if size > 4 else "uint32_t"  # parameter type of the functions
    return FieldView(
        name=name,
        doc=doc,
        declaration=f"{held} {name};",
        initial=_initial(field),
        refused=_refused(field, value),
        read=f"{value} = {_cast(held, unsigned, taken)};",
        offset=offset,
        put=f"{names.prefix}_put_{8 * size}",
        value=f"({wide}){value}" if field.format.signed else value,
        byte=(f"(uint8_t){value}" if field.format.signed else value) if size == 1 else "",
    )


def _array_view(names: Names, field: Field, offset: int, read_from: str) -> FieldView:
    """Make the view of an array, which is the last field of a frame."""
    assert field.array
    name, size = field.name, field.array.item.size
    value = f"message->{name}"
    counted = f"(size - {offset}U) / {size}U"
    return FieldView(
        name=name,
        doc=field_doc(names, field),
        declaration=f"{names.prefix}_array {name};",
        initial="{NULL, 0U}",
        refused=(),
        read=f"{value}.bytes = &{read_from}[{offset}];\n        {value}.count = {counted};",
        offset=offset,
        put=f"{names.prefix}_put_bytes",
        value=f"{value}.count * {size}U, {value}.bytes",
    )


def integer_type(format: Format) -> str:
    """Return the type of an integer of a format."""
    bits = max(8, 1 << (8 * format.size - 1).bit_length())
    return f"{'' if format.signed else 'u'}int{bits}_t"


def read_integer(names: Names, format: Format, source: str) -> str:
    """Return the expression that reads an integer at a pointer."""
    taken = (
        f"*({source})" if format.size == 1 else f"{names.prefix}_get_{8 * format.size}({source})"
    )
    if format.signed and format.is_odd:
        return f"{names.prefix}_signed_{8 * format.size}({taken})"
    return f"({integer_type(format)}){taken}" if format.signed else taken


def write_integer(names: Names, format: Format, at: str, value: str) -> str:
    """Return the statement that writes an integer at a pointer."""
    if format.size == 1:
        return f"*({at}) = (uint8_t){value};"
    wide = "uint64_t" if format.size > 4 else "uint32_t"
    given = f"({wide}){value}" if format.signed else value
    return f"(void){names.prefix}_put_{8 * format.size}({at}, {given});"


def parameter_view(name: str, offset: int) -> FieldView:
    """Make the view of an unused parameter byte of a header."""
    return FieldView(
        name=name,
        doc=comment(["Unused parameter byte; from 0 to 255."], 4),
        declaration=f"uint8_t {name};",
        initial="0",
        refused=(),
        read=f"message->{name} = frame[{offset}];",
        offset=offset,
        put="",
        value="",
        byte=f"message->{name}",
    )


def written(fields: Sequence[FieldView], start: int = 0) -> tuple[str, ...]:
    """Return the statements that write consecutive fields to ``out``.

    Each function returns the position of the next field: counting from there makes smaller code than
    counting from the beginning. Fields of one byte are assigned.

    :param start: the offset of the byte that ``out`` points at.
    """
    if all(field.byte for field in fields):
        return tuple(f"out[{field.offset - start}] = {field.byte};" for field in fields)
    statements = []
    for index, field in enumerate(fields):
        first = f"&out[{field.offset - start}]" if field.offset > start else "out"
        place = "at" if index else first
        head = "at = " if index else "uint8_t *at = "
        if index == len(fields) - 1:
            head = "(void)"
        statements.append(f"{head}{field.put}({place}, {field.value});")
    return tuple(statements)


def initialiser(names: Names, fields: Sequence[FieldView]) -> str:
    """Return the initialiser of a struct: constants and defaults, zero for the rest.

    A macro writes its braces: formatters would take bare braces in a definition for a block.
    """
    return f"{names.macro_prefix}_BRACED({', '.join(field.initial for field in fields)})"


def _type(field: Field) -> str:
    return f"{'' if field.format.signed else 'u'}int{bits_of(field)}_t"


def _cast(wanted: str, given: str, expression: str) -> str:
    return expression if wanted == given else f"({wanted}){expression}"


def _initial(field: Field) -> str:
    value = field.constant if field.constant is not None else field.default
    return integer(value, field.format.size, field.format.signed) if value else "0"


def _refused(field: Field, value: str) -> tuple[str, ...]:
    bits, signed = bits_of(field), field.format.signed
    least = -(1 << (bits - 1)) if signed else 0
    greatest = (1 << (bits - signed)) - 1
    refused = []
    if field.minimum > least:
        refused.append(f"{value} < {integer(field.minimum, bits // 8, signed)}")
    if field.maximum < greatest:
        refused.append(f"{value} > {integer(field.maximum, bits // 8, signed)}")
    return tuple(refused)


def size_assertion(names: Names, layout: Layout, type: str) -> str:
    """Return the assertion that the struct of a layout is as large as its bytes on the wire."""
    facts = [f"sizeof({type}) >= {layout.length}U", f"{type}_holds_its_packet"]
    return call(f"{names.macro_prefix}_STATIC_ASSERT", facts, ";")

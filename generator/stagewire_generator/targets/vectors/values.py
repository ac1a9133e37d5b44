"""What one field may hold: plain, least and greatest values, names, and what an encoder refuses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from stagewire_generator.model import Field
from stagewire_generator.targets.vectors.wire import Value

__all__ = [
    "bad_values", "default", "greatest", "is_optional", "least", "named_values", "plain", "unfit_values"
]  # fmt: skip

_LETTERS = "Stagewire"
_LATIN_1 = "\u00b5\u00e9\u00ff"  # what UTF-8 would make two bytes of


def is_optional(field: Field) -> bool:
    """Whether an encoder may be asked without it."""
    return field.role in ("reserved", "constant")


def default(field: Field) -> Value:
    """Return what is sent for a field that is left out."""
    if field.format.kind == "text":
        return ""
    return "00" * field.format.size if field.format.kind == "bytes" else field.constant or 0


def plain(field: Field) -> Value:
    """Return a value by its place: bytes that count up where the range allows it, or the first name."""
    size = field.format.size
    if field.format.kind == "text":
        return _LETTERS[: max(1, size // 2)]
    counting = bytes((field.offset + i) % 0x7F + 1 for i in range(size))
    if field.format.kind == "bytes":
        return counting.hex()
    if field.enum:
        return field.enum.values[0].value
    number = int.from_bytes(counting, "little")
    return field.minimum + (number - field.minimum) % (field.maximum - field.minimum + 1)


def least(field: Field) -> Value:
    """Return the least value of the range; no text, and zeros."""
    return field.minimum if field.format.kind == "integer" else default(field)


def greatest(field: Field) -> Value:
    """Return the greatest value of the range; a field full of the last character, and ones."""
    size = field.format.size
    if field.format.kind == "text":
        return "\u00ff" * size
    return "ff" * size if field.format.kind == "bytes" else field.maximum


def named_values(field: Field) -> Iterator[tuple[str, Value]]:
    """Yield what is to be looked at in a field: the end of an id, and the value.

    All can be held; those out of the range are kept by a decoder, and refused by an encoder. Names of the
    document stand behind ``=``, so that none is taken for one of ours.
    """
    if field.format.kind == "text":
        yield from _texts(field)
    elif field.format.kind == "integer":
        yield from _integers(field)
    if field.format.kind != "integer" or _is_narrow(field):
        yield ".least", least(field)
        yield ".greatest", greatest(field)


def _is_narrow(field: Field) -> bool:
    """Whether the bytes of a number can hold more than its range."""
    format = field.format
    return (format.minimum, format.maximum) != (field.minimum, field.maximum)


def _texts(field: Field) -> Iterator[tuple[str, Value]]:
    size = field.format.size
    letters = _LETTERS * (size // len(_LETTERS) + 1)
    yield ".one", "S"
    yield ".full", letters[:size]
    yield ".latin_1", _LATIN_1[:size]
    if size > 2:
        yield ".nul", "S\0W"


def _integers(field: Field) -> Iterator[tuple[str, Value]]:
    format = field.format
    if field.enum:
        for named in field.enum.values:
            yield f"={named.name}", named.value
        yield from _unknown(field, {named.value for named in field.enum.values})
    if field.flags or field.flags_by_unit:
        yield from _flags(field)
    if field.minimum > format.minimum:
        yield ".below", field.minimum - 1
    if field.maximum < format.maximum:
        yield ".above", field.maximum + 1
    every_bit = _number(field, (1 << 8 * format.size) - 1)
    if _is_narrow(field) and every_bit != field.maximum:
        yield ".every_bit", every_bit


def _flags(field: Field) -> Iterator[tuple[str, Value]]:
    """Yield every bit that has a name alone, those of each table together, and all others."""
    tables = {"": field.flags} if field.flags else {}
    tables |= {f"{table.name}.": table for table in field.flags_by_unit.values()}
    unnamed = (1 << 8 * field.format.size) - 1
    yield ".no_flag", 0
    for prefix, table in tables.items():
        every = 0
        for bit in table.bits:
            every |= bit.mask
            yield f"={prefix}{bit.name}", _number(field, bit.mask)
        yield f".{prefix}every_flag", _number(field, every)
        unnamed &= ~every
    if unnamed:
        yield ".unknown_flags", _number(field, unnamed)


def _unknown(field: Field, known: set[int]) -> Iterator[tuple[str, Value]]:
    """Yield the least natural number without a name, in the range if one is."""
    numbers = range(max(0, field.minimum), field.maximum + 1)
    for value in (*numbers[: len(known) + 1], *range(len(known) + 1)):
        if value not in known and value <= field.format.maximum:
            yield ".unknown", value
            return


def _number(field: Field, bits: int) -> int:
    """Return the number that has these bits in the field."""
    size = field.format.size
    return int.from_bytes(bits.to_bytes(size, "little"), "little", signed=field.format.signed)


def unfit_values(field: Field) -> Iterator[tuple[str, Value]]:
    """Yield what is out of range, and no bytes can hold: the end of an id, and the value."""
    format = field.format
    if format.kind == "text":
        yield ".long", "S" * (format.size + 1)
    elif format.kind == "bytes":
        yield ".short", "00" * (format.size - 1)
        yield ".long", "00" * (format.size + 1)
    else:
        if field.minimum == format.minimum:
            yield ".below", field.minimum - 1
        if field.maximum == format.maximum:
            yield ".above", field.maximum + 1
        if _is_narrow(field):  # good bytes, and more beyond them
            yield ".beyond", int(plain(field)) + (1 << 8 * format.size)


def bad_values(field: Field) -> Iterator[tuple[str, Any]]:
    """Yield what is no value of its kind: the end of an id, and what stands in its place."""
    format = field.format
    if format.kind == "text":
        yield ".filled", "S\0"[-min(format.size, 2) :]  # with the NUL that fills it
        yield ".other_letters", "\u0416"
        yield ".number", 1
    elif format.kind == "bytes":
        yield ".half", "0"
        yield ".letters", "zz" * format.size
        yield ".number", 1
    else:
        yield ".text", "1"

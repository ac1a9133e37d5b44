"""Values of fields: their bytes, and contents of a layout with limits and named values.

They depend only on the fields. The framings put a content into a frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from stagewire_generator.model import Json
from stagewire_generator.model_fields import Field

Value = int | str | list[int]
"""An integer; text; bytes in hex; the integers of an array."""


def fields_to_bytes(fields: Iterable[Field], values: Json) -> bytes:
    """Return the bytes of consecutive fields; the values must fit their formats."""
    return b"".join([_to_bytes(field, values[field.name]) for field in fields])


def fields_from_bytes(fields: Iterable[Field], raw: bytes) -> Json:
    """Return the values of consecutive fields."""
    values: Json = {}
    at = 0
    for field in fields:
        end = len(raw) if field.array else at + field.format.size
        values[field.name] = _from_bytes(field, raw[at:end])
        at = end
    return values


def greatest_but(taken: Iterable[int | None], size: int) -> int | None:
    """Return the greatest number of ``size`` bytes that is not taken; None if all are taken."""
    known = set(taken)
    return next((n for n in range((1 << 8 * size) - 1, -1, -1) if n not in known), None)


def _to_bytes(field: Field, value: Value) -> bytes:
    format = field.format
    if isinstance(value, int):
        return value.to_bytes(format.size, "little", signed=format.signed)
    if isinstance(value, list):
        assert field.array is not None
        size, signed = field.array.item.size, format.signed
        return b"".join(number.to_bytes(size, "little", signed=signed) for number in value)
    if format.kind == "bytes":
        return bytes.fromhex(value)
    return value.encode("latin-1").ljust(format.size, b"\0")


def _from_bytes(field: Field, raw: bytes) -> Value:
    format = field.format
    if field.array:
        size = field.array.item.size
        pieces = [raw[at : at + size] for at in range(0, len(raw), size)]
        return [int.from_bytes(piece, "little", signed=format.signed) for piece in pieces]
    if format.kind == "integer":
        return int.from_bytes(raw, "little", signed=format.signed)
    return raw.hex() if format.kind == "bytes" else raw.decode("latin-1").rstrip("\0")


UNNAMED = ("param1", "param2")
"""Unused header parameters."""


class Content(NamedTuple):
    """The values of a message, valid or invalid.

    :param name: the last part of the ids of its cases.
    :param given: the values passed to an encoder, by field.
    :param held: the values in the bytes, by field.
    :param shown: the values that a decoder returns.
    :param ranged: whether all values are in range; other contents are decoded but not encoded.
    :param decoded: whether decoding it tests more than the contents with all fields at a limit.
    """

    name: str
    given: Json
    held: Json
    shown: Json
    ranged: bool = True
    decoded: bool = True


_ROWS = 3  # of the array in a content whose number of rows is not tested


def filled(
    fields: Sequence[Field], held: Json, number: Callable[[Field], int] | None = None
) -> Json:
    """Return values with an array as long as the other values state; unchanged if there is none.

    :param number: returns each integer; by default they count.
    """
    field = fields[-1] if fields else None
    if field is None or field.array is None:
        return held
    span = field.maximum - field.minimum + 1
    count = field.array.count(held)
    numbers = [
        number(field) if number else field.minimum + (place * 0x01010101 + 1) % span
        for place in range(count)
    ]
    return {**held, field.name: numbers}


def plain_content(fields: Sequence[Field]) -> Content:
    """Return a content whose bytes differ from each other as far as the fields allow."""
    rows = fields[-1].array.rows if fields and fields[-1].array else ""
    held = {field.name: default(field) if is_optional(field) else plain(field) for field in fields}
    held = filled(fields, held | ({rows: _ROWS} if rows else {}))
    given = {field.name: held[field.name] for field in fields if not is_optional(field)}
    return Content("plain", given, held, shown(fields, held))


def contents(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield all contents to test, without duplicates.

    First ``base``, then contents with all fields at a limit, then contents with one field at a limit or with
    a named value and the other fields as in ``base``. A field without a narrower range is tested only with
    all fields at a limit.
    """
    seen = set()
    for content in (base, *_together(fields, base), *_one_by_one(fields, base)):
        key = repr(content.held)
        if key not in seen:
            seen.add(key)
            yield content


def _together(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield contents with all fields at a limit, and one with all optional fields."""
    for name, value in (("least", least), ("greatest", greatest)):
        held = filled(fields, {field.name: value(field) for field in fields}, value)
        yield Content(name, held, held, shown(fields, held))
    spare = {field.name: plain(field) for field in fields if is_optional(field)}
    held = base.held | spare
    yield Content("reserved", held, held, shown(fields, held))


def _one_by_one(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield contents with one field at a limit or with a named value."""
    for field in fields:
        if field.role == "reserved":
            continue
        for name, value in named_values(field):
            held = base.held | {field.name: value}
            if not _fits(fields, held):
                continue
            held = filled(fields, held)
            yield Content(
                name=field.name + name,
                given={key: held[key] for key in (*base.given, field.name)},
                held=held,
                shown=shown(fields, held),
                ranged=not isinstance(value, int) or field.minimum <= value <= field.maximum,
                decoded=name not in (".least", ".greatest") and not field.selects,
            )


_LONGEST = 0xFFFF  # packet that a header can state


def _fits(fields: Sequence[Field], held: Json) -> bool:
    """Whether the array of these values fits into a packet, even if it is longer than allowed."""
    array = fields[-1].array
    if array is None:
        return True
    return fields[-1].offset + array.item.size * array.count(held) <= _LONGEST


def shown(fields: Iterable[Field], held: Json) -> Json:
    """Return the values that a decoder returns: all except unused parameters that are zero."""
    if all(held.get(name, True) for name in UNNAMED):
        return held
    return {
        field.name: held[field.name]
        for field in fields
        if held[field.name] or field.name not in UNNAMED or field.constant
    }


_LETTERS = "Stagewire"
_LATIN_1 = "\u00b5\u00e9\u00ff"  # characters with two bytes in UTF-8


def is_optional(field: Field) -> bool:
    """Whether a request to an encoder may leave the field out."""
    return field.role in ("reserved", "constant") or field.omitted is not None


def default(field: Field) -> Value:
    """Return the value sent for a field that is left out."""
    if field.format.kind == "text":
        return ""
    if field.array:
        return []
    if field.format.kind == "bytes":
        return "00" * field.format.size
    return field.constant or field.omitted or 0


def plain(field: Field) -> Value:
    """Return a value that depends on the offset: increasing bytes if the range allows, or the first name."""
    size = field.format.size
    if field.format.kind == "text":
        return _LETTERS[: max(1, size // 2)]
    if field.array:
        return []
    counting = bytes((field.offset + i) % 0x7F + 1 for i in range(size))
    if field.format.kind == "bytes":
        return counting.hex()
    if field.enum:
        return field.enum.values[0].value
    number = int.from_bytes(counting, "little")
    return field.minimum + (number - field.minimum) % (field.maximum - field.minimum + 1)


def least(field: Field) -> Any:
    """Return the least value of the range, also of the integers of an array, an empty text, or zeros."""
    return field.minimum if field.format.kind in ("integer", "array") else default(field)


def greatest(field: Field) -> Any:
    """Return the greatest value of the range, a text full of the last character, or bytes of ones."""
    size = field.format.size
    if field.format.kind == "text":
        return "\u00ff" * size
    return "ff" * size if field.format.kind == "bytes" else field.maximum


def named_values(field: Field) -> Iterator[tuple[str, Value]]:
    """Yield the values of a field to test, each with the end of an id.

    All of them fit the format. Values out of range are kept by a decoder and refused by an encoder. Names
    from the document follow ``=``, which distinguishes them from our names.
    """
    if field.format.kind == "text":
        yield from _texts(field)
    elif field.format.kind == "integer":
        yield from _integers(field)
    if field.array:
        return
    if field.format.kind != "integer" or _is_narrow(field):
        yield ".least", least(field)
        yield ".greatest", greatest(field)


def _is_narrow(field: Field) -> bool:
    """Whether the range of a number is narrower than its format."""
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
    for table in field.enumerations:
        prefix = "" if table is field.enum else f"{table.name}."
        for named in table.values:
            yield f"={prefix}{named.name}", named.value
    if field.enum:
        known = {named.value for table in field.enumerations for named in table.values}
        yield from _unknown(field, known)
    if field.flags or field.flags_by_unit:
        yield from _flags(field)
    if field.minimum > format.minimum:
        yield ".below", field.minimum - 1
    if field.maximum < format.maximum:
        yield ".above", field.maximum + 1
    if format.real:
        yield from _REALS[format.size].items()
    every_bit = _number(field, (1 << 8 * format.size) - 1)
    if _is_narrow(field) and every_bit != field.maximum:
        yield ".every_bit", every_bit


_REALS: Final[Mapping[int, Mapping[str, int]]] = {
    4: {
        ".real": 0x3F800000,
        ".negative_zero": 0x80000000,
        ".infinite": 0x7F800000,
        ".not_a_number": 0x7FC00000,
        ".signalling": 0x7F800001,
        ".denormal": 0x00000001,
    },
    8: {
        ".real": 0x3FF0000000000000,
        ".negative_zero": 0x8000000000000000,
        ".infinite": 0x7FF0000000000000,
        ".not_a_number": 0x7FF8000000000000,
        ".signalling": 0x7FF0000000000001,
        ".denormal": 0x0000000000000001,
    },
}
"""Bit patterns of real numbers that a conversion to a number and back may change, and that of 1, by size."""


def _flags(field: Field) -> Iterator[tuple[str, Value]]:
    """Yield each named bit, all bits of each table, and all unnamed bits."""
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
    """Yield the least natural number without a name, preferably in range."""
    numbers = range(max(0, field.minimum), field.maximum + 1)
    for value in (*numbers[: len(known) + 1], *range(len(known) + 1)):
        if value not in known and value <= field.format.maximum:
            yield ".unknown", value
            return


def _number(field: Field, bits: int) -> int:
    """Return the number with these bits in the format of the field."""
    size = field.format.size
    return int.from_bytes(bits.to_bytes(size, "little"), "little", signed=field.format.signed)


def unfit_values(field: Field, plain_value: Value) -> Iterator[tuple[str, Value]]:
    """Yield values that do not fit the format, each with the end of an id.

    :param plain_value: its value in the plain content, which is of the right length for an array.
    """
    format = field.format
    if isinstance(plain_value, list):
        yield from _unfit_arrays(field, plain_value)
        return
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
        if _is_narrow(field):  # valid low bytes, and a bit above them
            assert isinstance(plain_value, int)
            yield ".beyond", plain_value + (1 << 8 * format.size)


def _unfit_arrays(field: Field, numbers: list[int]) -> Iterator[tuple[str, Value]]:
    yield ".empty", []
    yield ".short", numbers[:-1]
    yield ".long", [*numbers, field.minimum]
    yield ".below", [*numbers[:-1], field.minimum - 1]
    yield ".above", [field.maximum + 1, *numbers[1:]]


def bad_values(field: Field) -> Iterator[tuple[str, Any]]:
    """Yield values of a wrong type, each with the end of an id."""
    format = field.format
    if format.kind == "text":
        yield ".filled", "S\0"[-min(format.size, 2) :]  # with the NUL that fills the field
        yield ".other_letters", "\u0416"
        yield ".number", 1
    elif field.array:
        yield ".number", 1
        yield ".text", "00"
        yield ".of_text", ["1"]
    elif format.kind == "bytes":
        yield ".half", "0"
        yield ".letters", "zz" * format.size
        yield ".number", 1
    else:
        yield ".text", "1"

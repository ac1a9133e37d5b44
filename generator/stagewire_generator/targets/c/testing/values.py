"""Values in C: of fields, and of examples that state them in units and in counts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.model_scales import (
    Factor,
    Quantity,
)
from stagewire_generator.targets.c.source import WIDTH, Names, bits_of, integer, octets
from stagewire_generator.targets.vectors.values import default, is_optional

_LONGEST_STRING = 4095  # length of a literal that every compiler accepts
_LONG = 60  # maximum number of characters of a literal on a line
_CHARACTER = re.compile(r"\\[0-7]{3}|\\?.")

Item: TypeAlias = str | tuple[str, ...]
"""A line; or the text before a string literal, and its pieces, one per line."""

_SMALL = range(-0x7FFF, 0x8000)  # the range of int on every platform
_BYTE = len("0x00, ")
_BYTES = [f"0x{byte:02X}" for byte in range(0x100)]


class CannotSayError(Exception):
    """A case cannot be written in C; the message is the reason. Such cases are left out and counted."""


def can_hold(field: Field, value: int) -> bool:
    """Whether an integer fits the type of the struct member."""
    bits, signed = bits_of(field), field.format.signed
    return -(1 << bits - 1) * signed <= value < 1 << bits - signed


def whole(fields: Iterable[Field], values: Mapping[str, object]) -> dict[str, object]:
    """Return the values of all fields, with defaults for optional ones.

    :raises CannotSayError: if a field is missing or unknown: a struct has all of its members.
    """
    made: dict[str, object] = {}
    for field in fields:
        if field.name in values:
            made[field.name] = values[field.name]
        elif is_optional(field):
            made[field.name] = default(field)
        else:
            raise CannotSayError("a missing field")
    if not made.keys() >= values.keys():
        raise CannotSayError("an unknown field")
    return made


def from_bytes(fields: Iterable[Field], packet: bytes) -> dict[str, object]:
    """Return the values of fields from the bytes of a packet."""
    return {field.name: _from_bytes(field, packet[field.offset :]) for field in fields}


def _from_bytes(field: Field, rest: bytes) -> object:
    format, raw = field.format, rest[: field.format.size]
    if format.kind == "integer":
        return int.from_bytes(raw, "little", signed=format.signed)
    return raw.hex() if format.kind == "bytes" else raw.rstrip(b"\0").decode("latin-1")


def members(fields: Iterable[Field], values: Mapping[str, object]) -> list[Item]:
    """Return the initialisers of the members of a struct.

    :raises CannotSayError: if a value does not fit the type of its member.
    """
    made: list[Item] = []
    for field in fields:
        if field.array:
            made += _array_members(field, values[field.name])
            continue
        value = _initial(field, values[field.name])
        head = f".{field.name} = "
        made.append(head + value if len(value) <= _LONG else (head, *_pieces(value)))
    return made


def _array_members(field: Field, value: object) -> list[Item]:
    """Return the initialisers of an array: its number of integers, and their bytes as a string literal."""
    item = field.array.item if field.array else field.format
    if not isinstance(value, list) or not all(type(number) is int for number in value):
        raise CannotSayError("a value of another type")
    if not all(item.minimum <= number <= item.maximum for number in value):
        raise CannotSayError("a value that does not fit its type")
    raw = b"".join(number.to_bytes(item.size, "little", signed=item.signed) for number in value)
    if len(raw) > _LONGEST_STRING:
        raise CannotSayError("more bytes than a string literal can have")
    name = f".{field.name}"
    head = f"{name}.bytes = (const uint8_t *)"
    return [f"{name}.count = {len(value)}U", (head, *_pieces(octets(raw)))]


def literal_of(head: str, raw: bytes) -> Item:
    """Return ``head`` and a pointer to bytes; many bytes are written as a string."""
    shown = f"{head}(const uint8_t[]){{{', '.join(array(raw))}}}"
    if len(shown) <= WIDTH // 2:
        return shown
    return (f"{head}(const uint8_t *)", *_pieces(octets(raw)))


def literal(field: Field, value: int) -> str:
    """Return the literal of an integer that fits the type of the member."""
    if value in _SMALL:
        return str(value)
    return integer(value, bits_of(field) // 8, field.format.signed)


def _initial(field: Field, value: object) -> str:
    """Return the initialiser of a member; text and long byte strings are string literals."""
    format = field.format
    if format.kind == "integer":
        return _field_integer(field, value)
    if not isinstance(value, str):
        raise CannotSayError("a value of another type")
    try:
        raw = bytes.fromhex(value) if format.kind == "bytes" else value.encode("latin-1")
    except ValueError:  # includes encoding errors
        raise CannotSayError("a text that is invalid for its field") from None
    if len(raw) > format.size or (format.kind == "bytes" and len(raw) != format.size):
        raise CannotSayError("a text or bytes of another length")
    if not raw.strip(b"\0"):
        return "{0}"
    shown = f"{{{', '.join(array(raw))}}}"
    return shown if format.kind == "bytes" and len(shown) <= _LONG else octets(raw)


def _pieces(text: str) -> list[str]:
    """Return a string literal in pieces, one per line."""
    characters = _CHARACTER.findall(text[1:-1])
    lines = [""]
    for character in characters:
        if len(lines[-1]) + len(character) > _LONG:
            lines.append("")
        lines[-1] += character
    return [f'"{line}"' for line in lines]


def _field_integer(field: Field, value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int):
        raise CannotSayError("a value of another type")
    if not can_hold(field, value):
        raise CannotSayError("a value that does not fit its type")
    return literal(field, value)


def array(raw: bytes) -> list[str]:
    """Return bytes as initialisers; a zero for no bytes, since C has no empty arrays."""
    return [_BYTES[byte] for byte in raw or b"\0"]


def byte_rows(head: str, raw: bytes, tail: str, indent: int) -> str:
    """Return bytes between head and tail, like :func:`filled`; all items have the same length."""
    items, pad = array(raw), " " * (indent + 4)
    first = (WIDTH - 1 - indent - len(head)) // _BYTE
    rest = (WIDTH - 1 - len(pad)) // _BYTE
    rows = [items[:first], *(items[i : i + rest] for i in range(first, len(items), rest))]
    return head + f",\n{pad}".join([", ".join(row) for row in rows]) + tail


def filled(head: str, items: Sequence[Item], tail: str, indent: int) -> str:
    """Return items between head and tail, as many per line as fit, with room for a comma at the end.

    The first line is not indented: the template does that. The other lines are indented one step more.
    """
    try:
        line = f"{head}{', '.join(items)}{tail}"  # type: ignore[arg-type]
    except TypeError:
        line = ""  # some are strings on separate lines
    if line and indent + len(line) < WIDTH:
        return line
    first, pad = " " * indent + head, " " * (indent + 4)
    lines, full = [first], False
    for item in items:
        if isinstance(item, str):
            line = lines[-1] + ("" if lines[-1] == first else " ") + item
            if full or len(line) + len(tail) >= WIDTH:
                lines.append(f"{pad}{item},")
            else:
                lines[-1] = f"{line},"
        else:
            name, *pieces = item
            # clang-format indents a first argument at the beginning of a line one step more
            start = pad if lines != [first] else f"{pad}    "
            column = " " * len(start + name)
            lines += [f"{start}{name}{pieces[0]}", *(column + piece for piece in pieces[1:])]
            lines[-1] += ","
        full = not isinstance(item, str)
    lines[-1] = lines[-1].removesuffix(",") + tail
    return "\n".join(lines)[indent:]


_LEAST, _GREATEST = -(1 << 63), (1 << 63) - 1
_POWERS = (  # units of the same dimension, as powers of ten of the first
    {"s": 0, "ms": -3, "us": -6},
    {"m": 0, "mm": -3, "um": -6, "nm": -9},
    {"V": 0, "mV": -3},
)


class Conversions:
    """Finds the scale of a stated value, by its name in quantities.h."""

    def __init__(self, protocol: Protocol, names: Names) -> None:
        self._quantities = {quantity.name: quantity for quantity in protocol.quantities}
        self._stages = {stage.name: stage.scales for stage in protocol.stages}
        self._names = names

    def members(self, name: str, item: Json) -> list[str]:
        """Return the members of a ``struct conversion`` in the file of the examples.

        :raises CannotSayError: if the value has no scale.
        """
        words, unit, scale = self._scale(name, item)
        value = _ratio(_fraction(item["value"]) * _between(item["unit"], unit))
        made = [f".value = {value}"]
        if isinstance(scale, Factor):
            made.append(f".scale = {self._names.macro('scale_' + '_'.join(words))}")
        else:
            setting = item.get("setting", {}).get(scale.get("setting"))
            if setting is None or "counts_at_setting" not in scale:
                raise CannotSayError("a value without a scale")
            function = "_".join(("scale", *words)).lower()
            made.append(f".by_setting = {self._names.prefix}_{function}")
            made.append(f".setting = {_ratio(_fraction(setting))}")
        return [*made, f".counts = {_wide_integer(item['exact'])}"]

    def _scale(self, name: str, item: Json) -> tuple[tuple[str, ...], str, Factor | Json]:
        """Return the words of the name of a scale, its unit, and the scale."""
        quantity = self._quantities.get(name)
        if quantity is None:
            raise CannotSayError("an unknown quantity")
        if quantity.factor:
            return (name,), quantity.unit, quantity.factor
        rule = quantity.rule
        if "cases" in rule:
            case = str(item.get("setting", {}).get(rule["setting"]))
            found = _of(rule["cases"], case)
            return (name, case), found["unit"], found["scale"]
        if "units" in rule:
            device = item.get("controller") or item.get("device") or ""
            return (name, device), quantity.unit, _of(rule["units"], device)
        if rule.get("by") == "stage":
            return self._of_stage(quantity, item)
        return (name,), quantity.unit, rule

    def _of_stage(
        self, quantity: Quantity, item: Json
    ) -> tuple[tuple[str, ...], str, Factor | Json]:
        stage, controller = item.get("stage", ""), item.get("controller", "")
        found = _of(_of(_of(self._stages, stage), controller), quantity.name)
        words = stage, controller, quantity.name
        return words, quantity.unit, {} if isinstance(found, str) else found


def _of(table: Mapping[str, Any], key: str) -> Any:
    if key not in table:
        raise CannotSayError("a value without a scale")
    return table[key]


def _fraction(number: int | str) -> Fraction:
    try:
        return Fraction(number)
    except ValueError:  # a setting may be a name
        raise CannotSayError("a value that is not a number") from None


def _ratio(value: Fraction) -> str:
    return f"{{{_wide_integer(value.numerator)}, {_wide_integer(value.denominator)}}}"


def _wide_integer(value: int) -> str:
    if not _LEAST <= value <= _GREATEST:
        raise CannotSayError("a value of more than 64 bits")
    return integer(value, 8, signed=True)


def _between(unit: str, wanted: str) -> Fraction:
    """Return the factor that converts a value from one unit to another."""
    (above, _, below), (wanted_above, _, wanted_below) = unit.partition("/"), wanted.partition("/")
    for powers in _POWERS:
        if below == wanted_below and above in powers and wanted_above in powers:
            return Fraction(10) ** (powers[above] - powers[wanted_above])
    if unit != wanted:
        raise CannotSayError("a value in an incompatible unit")
    return Fraction(1)

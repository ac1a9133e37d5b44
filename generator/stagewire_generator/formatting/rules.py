"""The rules of the canonical form: order of keys, quotes, hexadecimal numbers.

The schema of a file determines the order of its keys, and which numbers are written in hex.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from stagewire_generator.formatting.tree import Collection, Entry, Node, Scalar
from stagewire_generator.schemas import schema_folder
from stagewire_generator.strict_yaml import is_plain_text

_IN_HEX = "x-hex"
_PARTS = ("if", "then", "else")
_ALTERNATIVES = ("allOf", "anyOf", "oneOf")


class Shape:
    """The form of one value in a file according to its schema; alternatives are merged."""

    def __init__(self, schemas: Iterable[dict[str, Any]], definitions: dict[str, Any]) -> None:
        self._definitions = definitions
        self.schemas = [part for schema in schemas for part in self._parts(schema)]
        self._inside: dict[str | None, Shape] = {}
        names = [name for schema in self.schemas for name in schema.get("properties", ())]
        self.order = {name: place for place, name in enumerate(dict.fromkeys(names))}
        """Position of each key in the schema; entries under keys from a pattern keep their order."""
        self.in_hex = any(schema.get(_IN_HEX) is True for schema in self.schemas)
        """Whether a number is written in hex; otherwise its author chooses the notation."""

    def inside(self, key: str | None) -> Shape:
        """Return the shape of the value of a key, or of the items of a list for None."""
        if key not in self._inside:
            found = self._items() if key is None else self._values(key)
            self._inside[key] = Shape(found, self._definitions)
        return self._inside[key]

    def _items(self) -> Iterator[dict[str, Any]]:
        for schema in self.schemas:
            if isinstance(schema.get("items"), dict):
                yield schema["items"]

    def _values(self, key: str) -> Iterator[dict[str, Any]]:
        for schema in self.schemas:
            if isinstance(found := schema.get("properties", {}).get(key), dict):
                yield found
                continue
            for pattern, found in schema.get("patternProperties", {}).items():
                if isinstance(found, dict) and re.search(pattern, key):
                    yield found

    def _parts(self, schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield a schema and all schemas in it that apply to the same value."""
        yield schema
        if reference := schema.get("$ref"):
            yield from self._parts(self._definitions[reference.rpartition("/")[2]])
        beside = [schema[name] for name in _PARTS if name in schema]
        for name in _ALTERNATIVES:
            beside += schema.get(name, [])
        beside += schema.get("dependentSchemas", {}).values()
        for part in beside:
            if isinstance(part, dict):
                yield from self._parts(part)


UNKNOWN = Shape((), {})


@cache
def shape(kind: str) -> Shape:
    """Return the shape of a whole file of this kind."""
    text = (schema_folder() / f"{kind}.schema.json").read_text(encoding="utf-8")
    schema = json.loads(text)
    return Shape([schema], schema.get("$defs", {}))


_OBVIOUS = re.compile(  # a name or prose, which cannot be mistaken for a number, bytes or symbols
    r"""[a-z][a-z0-9]*(_[a-z0-9]+)* | [A-Z][A-Z0-9]*(_[A-Z0-9]+)+
    | (?=.*[a-z])[^\W\d_](?:[^\W\d]|[\x20.;/()'-])*(?<!\x20)""",
    re.VERBOSE,
)
_KEY = re.compile(r"[^\W\d]\w*")
_HEX = re.compile(r"0x([0-9A-Fa-f]+)\Z")
_NUMBER = re.compile(r"(?:0|[1-9][0-9]*)\Z")


def needs_quotes(scalar: Scalar) -> bool:
    """Whether a quoted text keeps its quotes."""
    if scalar.style not in ('"', "'"):
        return False
    return not (_OBVIOUS.fullmatch(scalar.value) and is_plain_text(scalar.value))


def spell_key(key: Scalar) -> None:
    """Set the canonical spelling of a key, which is a name and needs quotes less often."""
    if _KEY.fullmatch(key.value) and is_plain_text(key.value):
        key.source, key.style = key.value, ""
    else:
        spell(key)


def spell(scalar: Scalar, *, in_hex: bool = False, keep_quotes: bool = False) -> None:
    """Set the canonical spelling of a scalar on one line; leave blocks unchanged.

    :param in_hex: write a decimal number in hex.
    :param keep_quotes: keep quotes that are not needed.
    """
    if scalar.block:
        return
    if not scalar.style:
        scalar.source = _plain(scalar.value, in_hex)
    elif not keep_quotes and not needs_quotes(scalar):
        scalar.source, scalar.style = scalar.value, ""
    elif scalar.style == "'" and not {'"', "\\"} & set(scalar.value):
        scalar.source, scalar.style = f'"{scalar.value}"', '"'
    if "\n" in scalar.source or "\n" in scalar.value:
        scalar.source, scalar.style = _escaped(scalar.value), '"'


def _plain(value: str, in_hex: bool) -> str:
    """Return a hex number in whole bytes of upper-case digits, null as a word, any other text unchanged."""
    if found := _HEX.match(value):
        digits = found[1].upper()
        return f"0x{digits.rjust(len(digits) + len(digits) % 2, '0')}"
    if in_hex and _NUMBER.match(value):
        return _plain(f"0x{int(value):X}", in_hex)
    return value or "null"


def _escaped(value: str) -> str:
    """Return a text on one line in quotes."""
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t"}
    return f'"{"".join(escapes.get(c) or _visible(c) for c in value)}"'


def _visible(char: str) -> str:
    if char.isprintable():
        return char
    return f"\\x{ord(char):02X}" if char <= "\xff" else f"\\U{ord(char):08X}"


def canonicalise(node: Node, shape: Shape, *, keep_quotes: bool = False) -> None:
    """Make a tree canonical, in place.

    :param shape: the shape of this node in the schema.
    :param keep_quotes: keep quotes that are not needed.
    """
    if not isinstance(node, Collection):
        spell(node, in_hex=shape.in_hex, keep_quotes=keep_quotes)
        return
    if node.mapping:
        node.entries = _ordered(node.entries, shape)
        keep_quotes = False
    else:  # the items of a list look alike: either all or none keep their quotes
        keep_quotes = keep_quotes or any(map(needs_quotes, node.scalars()))
    for entry in node.entries:
        key = entry.key
        if key is not None:
            spell_key(key)
        inner = shape.inside(key.value if key else None)
        canonicalise(entry.value, inner, keep_quotes=keep_quotes)


def _ordered(entries: list[Entry], shape: Shape) -> list[Entry]:
    """Return entries in the order of the schema; an unknown key stays after the key before it."""
    places: list[tuple[int, Entry]] = []
    place = -1
    for entry in entries:
        if entry.key is not None:
            place = shape.order.get(entry.key.value, place)
        places.append((place, entry))
    return [entry for _, entry in sorted(places, key=lambda pair: pair[0])]

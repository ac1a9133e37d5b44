"""What a JSON Schema says of the shape of a file: the order of keys, and which numbers are written in hex."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from stagewire_generator.schemas import schema_folder

__all__ = ["UNKNOWN", "Shape", "shape"]

_IN_HEX = "x-hex"
_PARTS = ("if", "then", "else")
_ALTERNATIVES = ("allOf", "anyOf", "oneOf")


class Shape:
    """What the schema says of one place of a file; where it has alternatives, what all of them say."""

    def __init__(self, schemas: Iterable[dict[str, Any]], definitions: dict[str, Any]) -> None:
        self._definitions = definitions
        self._schemas = [part for schema in schemas for part in self._parts(schema)]
        self._inside: dict[str | None, Shape] = {}
        names = [name for schema in self._schemas for name in schema.get("properties", ())]
        self.order = {name: place for place, name in enumerate(dict.fromkeys(names))}
        """Place of each key that the schema names; entries under keys of a pattern keep theirs."""
        self.in_hex = any(schema.get(_IN_HEX) is True for schema in self._schemas)
        """Whether a number is written in hex; else it is written as its author likes."""

    def inside(self, key: str | None) -> Shape:
        """Return the shape of the value of a key; of the items of a list for None."""
        if key not in self._inside:
            found = self._items() if key is None else self._values(key)
            self._inside[key] = Shape(found, self._definitions)
        return self._inside[key]

    def _items(self) -> Iterator[dict[str, Any]]:
        for schema in self._schemas:
            if isinstance(schema.get("items"), dict):
                yield schema["items"]

    def _values(self, key: str) -> Iterator[dict[str, Any]]:
        for schema in self._schemas:
            if isinstance(found := schema.get("properties", {}).get(key), dict):
                yield found
                continue
            for pattern, found in schema.get("patternProperties", {}).items():
                if isinstance(found, dict) and re.search(pattern, key):
                    yield found

    def _parts(self, schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield a schema and those that hold for the same place."""
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

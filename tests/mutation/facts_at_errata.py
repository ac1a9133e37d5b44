"""Every fact of the registry at a place of an erratum, and a wrong value for each.

An erratum excuses one difference, so ``check`` must still refuse any other value there. The facts are found
from the names of the places: an id, a page, a length, the names and formats of a table of fields, a bound or
default, and every value or bit of a list. As a program, this module tries all of them, and prints those whose
wrong value passes ``check``:

    python tests/mutation/facts_at_errata.py
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, count
from typing import Any

from mutants import OTHER_SIGN, PROTOCOLS, Proof, proof_of
from registry_values import RegistryValue

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.lint.witness.reading import squash
from stagewire_generator.model import Message
from stagewire_generator.model_fields import Enumeration, Field, FlagTable
from stagewire_generator.pipeline import check_protocol
from stagewire_generator.strict_yaml import Document, KeyPath

_BOUNDS = {"from": "minimum", "to": "maximum", "default": "default"}
_BOUNDS |= {"minimum": "minimum", "maximum": "maximum"}
_SIZES = ("length", "structure", "packet", "last_offset", "size", "returns")
_KEYS = {"dec": "byte", "hex": "byte", "command": "byte"}
_ID = ("id", "ids", "byte")
_OTHER_SIZE = {"byte": "word", "char": "word", "u8": "u16"}


@dataclass(frozen=True)
class Fact(RegistryValue):
    """A value in a file of the registry, or the name of an entry.

    :param named: whether it is the name.
    :param taken: other values of the same list.
    """

    named: bool = False
    taken: frozenset[int] = frozenset()

    def __str__(self) -> str:
        return f"{super().__str__()}{' (name)' if self.named else ''}"

    @contextmanager
    def wrong(self) -> Iterator[None]:
        """Change the fact while the context lasts."""
        holder, key = self.holder, self.path[-1]
        with self.restored():
            if self.named:
                others = {f"{k}x" if k == key else k: v for k, v in holder.items()}
                holder.clear()
                holder.update(others)
            else:
                holder[key] = self._other(holder[key])
            yield

    def _other(self, value: Any) -> Any:
        if isinstance(value, int):
            others = range(32) if self.path[-1] == "bit" else count(value + 1)
            return next(number for number in others if number not in {value, *self.taken})
        if self.path[-1] == "size":
            return 1  # of a command that leaves the slot out
        if self.path[-1] == "format":
            return OTHER_SIGN.get(value) or _OTHER_SIZE.get(value, "byte")
        return f"{value}x"


class Facts:
    """Finds the facts of a protocol by the names of places."""

    def __init__(self, proof: Proof) -> None:
        self.proof = proof
        self.messages = {message.name: message for message in proof.protocol.messages}
        kinds = ("protocol", "messages", "units")
        documents = [document for kind in kinds for document in proof.files.get(kind, [])]
        self._paths: dict[Place, tuple[Document, KeyPath]] = {}
        for document in documents:
            for path in document.places:
                self._paths.setdefault(document.place(*path), (document, path))

    def all(self) -> dict[str, Fact]:
        """Return the facts at the places of all errata, each once."""
        places = (place for erratum in self.proof.protocol.errata for place in erratum.places)
        return {str(fact): fact for place in places for fact in self.at(place)}

    def at(self, place: str) -> Iterator[Fact]:
        """Yield the facts at a place."""
        chapter, *parts = place.split("/")
        message = next((self.messages[part] for part in parts if part in self.messages), None)
        if chapter == "addresses":
            [head] = self.proof.files["protocol"]
            devices = head.data["framing"]["devices"]
            for index in range(len(devices)):
                yield Fact(head, ("framing", "devices", index), taken=frozenset(devices))
        elif chapter == "axis":
            name = self.proof.protocol.framing["axes"]
            [axes] = [table for table in self.proof.protocol.enumerations if table.name == name]
            yield from self._table(axes, [])
        elif message:
            yield from self._of_message(message, chapter, parts)

    def _of_message(self, message: Message, chapter: str, parts: list[str]) -> Iterator[Fact]:
        document, path = self._paths[message.place]
        entry, last = self._entry(message.place), parts[-1]
        fields = list(chain.from_iterable(layout.all_fields for layout in message.layouts))
        keys = {*_ID} if last == "id" else {_KEYS.get(last, last)}
        keys |= {"title"} if "byte" in entry and last == "name" else set()
        for key in keys & entry.keys():
            if isinstance(entry[key], dict):
                yield from (Fact(document, (*path, key, inner)) for inner in entry[key])
            else:
                yield Fact(document, (*path, key))
        if last in _SIZES:
            yield from self._keys(fields, "format")
        elif chapter == "rows" or "columns" in parts or last.startswith("param"):
            yield from self._names(fields)
            if chapter == "rows":
                yield from self._keys(fields, "format")
        elif chapter in ("ranges", "range"):
            meant = [field for field in fields if field.name in parts] or fields
            yield from self._keys(meant, _BOUNDS.get(last, ""))
        elif chapter == "format":
            yield from self._keys(fields, "format")
        elif chapter == "values":
            for field in fields:
                if squash(field.name) == parts[1]:
                    tables = (*field.enumerations, field.flags, *field.flags_by_unit.values())
                    for table in filter(None, tables):
                        yield from self._table(table, self._stated(parts))

    def _stated(self, parts: list[str]) -> list[str]:
        """Return the names of values that errata state for a list."""
        start = "/".join(["values", *parts[:2]])
        return [
            encoded
            for erratum in self.proof.protocol.errata
            for place, (_, encoded) in erratum.places.items()
            if place.startswith(start)
        ]

    def _table(self, table: Enumeration | FlagTable, names: Iterable[str]) -> Iterator[Fact]:
        """Yield every value of a table, and the names that are stated."""
        document, path = self._paths[table.place]
        section, key = ("bits", "bit") if isinstance(table, FlagTable) else ("values", "value")
        entries = self._entry(table.place)[section]
        taken = frozenset(entry[key] for entry in entries.values())
        for name in entries:
            yield Fact(document, (*path, section, name, key), taken=taken)
            if name.lower() in names:
                yield Fact(document, (*path, section, name), named=True)

    def _keys(self, fields: Iterable[Field], key: str) -> Iterator[Fact]:
        for field in fields:
            document, path = self._paths[field.place]
            entry = self._entry(field.place)
            if isinstance(entry, dict) and key in entry:
                yield Fact(document, (*path, key))

    def _names(self, fields: Iterable[Field]) -> Iterator[Fact]:
        """Yield the names of fields; the document does not name those without a meaning."""
        for field in fields:
            if field.role == "reserved":
                continue
            document, path = self._paths[field.place]
            if path[-1] == field.name:
                yield Fact(document, path, named=True)
            elif "name" in self._entry(field.place):
                yield Fact(document, (*path, "name"))

    def _entry(self, place: Place) -> Any:
        document, path = self._paths[place]
        node = document.data
        for step in path:
            node = node[step]
        return node


def passes(proof: Proof, fact: Fact) -> bool:
    """Whether ``check`` accepts the registry with a wrong value for a fact."""
    with fact.wrong():
        diagnostics = Diagnostics()
        check_protocol(proof.files, diagnostics, lambda _: None)
        return not diagnostics.found


def main() -> int:
    """Try all facts and print those whose wrong value passes."""
    for name in PROTOCOLS:
        proof = proof_of(name)
        facts = Facts(proof).all().values()
        survivors = [fact for fact in facts if passes(proof, fact)]
        for fact in survivors:
            print(f"passes: {fact}")
        print(f"{name}: {len(facts)} facts, {len(survivors)} pass with a wrong value")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Collect the changes of one protocol, and compare attributes as the tables specify."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire_generator.change.attributes import ATTRIBUTES
from stagewire_generator.change.changes import KINDS, Change
from stagewire_generator.change.entries import Attribute, Data, Entries, Names, Sequence
from stagewire_generator.change.matching import Matches, Pairs
from stagewire_generator.model import Json

Where = Mapping[str, str]
NOWHERE: Where = {}

_HEX = {  # kind -> digits
    "address": 2,
    "field-constant": 2,
    "framing": 2,
    "message-id": 4,
    "message-id-added": 4,
    "value-number": 2,
}


def change(
    kind: str,
    protocol: str,
    where: Where = NOWHERE,
    old: object = None,
    new: object = None,
    text: str = "",
) -> Change:
    """Return a change of a kind, with its values in readable form."""
    found = KINDS[kind]
    before, after = (_shown(value, _HEX.get(kind, 0)) for value in (old, new))
    return Change(kind, found.level, protocol, dict(where), before, after, text or found.meaning)


class Comparison:
    """The changes found in one protocol."""

    def __init__(self, protocol: str, matches: Matches) -> None:
        self.protocol = protocol
        self.matches = matches
        self.changes: list[Change] = []

    def add(
        self, kind: str, where: Where, old: object = None, new: object = None, text: str = ""
    ) -> None:
        """Add a change; the default for ``text`` is the meaning of its kind."""
        self.changes.append(change(kind, self.protocol, where, old, new, text))

    def renamed(self, kind: str, name: str) -> str:
        """Return the new name for ``name`` or ``NAME.field`` of the old registry."""
        first, dot, field = name.partition(".")
        return self.matches.renamed(kind).get(first, first) + dot + field

    def names(self, kind: str, noun: str, pairs: Pairs[Any], where: Where = NOWHERE) -> None:
        """Add a change for each thing of a kind that was added, removed or renamed.

        :param kind: first word of the three kinds of changes.
        :param noun: the noun for such a thing in ``where``.
        """
        for thing in pairs.removed:
            self.add(f"{kind}-removed", {**where, noun: thing.name}, thing.name, None)
        for thing in pairs.added:
            self.add(f"{kind}-added", {**where, noun: thing.name}, None, thing.name)
        for old, new in pairs.renamed.items():
            self.add(f"{kind}-renamed", {**where, noun: new}, old, new)

    def attributes(self, where: Where, old: object, new: object) -> None:
        """Compare two dataclasses of the model, attribute by attribute."""
        for name, attribute in ATTRIBUTES[type(old)].items():
            before, after = getattr(old, name), getattr(new, name)
            if isinstance(attribute, Data):
                self.data(where, attribute.table, before, after)
            else:
                self.attribute(where, name, attribute, before, after)

    def attribute(
        self, where: Where, name: str, attribute: Attribute | Entries, old: Any, new: Any
    ) -> None:
        """Compare one value, unless it is compared elsewhere or ignored."""
        if isinstance(attribute, Names):
            kind, of = attribute.kind, attribute.of
            expected = self._renamed(of, old)
        elif isinstance(attribute, str | Sequence):
            kind = attribute if isinstance(attribute, str) else attribute.kind
            expected = old
        else:
            return
        if _plain(expected) == _plain(new):
            return
        where = {**where, "attribute": name}
        unordered = not isinstance(attribute, Sequence) and _listed(expected) and _listed(new)
        if unordered and sorted(expected) == sorted(new):
            kind = "order"
        self.add(kind, where, old, new)

    def data(
        self,
        where: Where,
        table: Mapping[str, Attribute | Entries],
        old: Json,
        new: Json,
        path: str = "",
    ) -> None:
        """Compare plain data by a table of paths; a path that is not in the table counts as WIRE."""
        for key in (*old, *(key for key in new if key not in old)):
            named = f"{path}{key}"
            inside = named in table or any(known.startswith(f"{named}/") for known in table)
            pattern = named if inside else f"{path}*"
            entry = table.get(pattern)
            before, after = old.get(key), new.get(key)
            if isinstance(entry, Entries):
                at = {**where, entry.noun: key}
                if before is None or after is None:
                    kind = entry.added if before is None else entry.removed
                    ends = (None, key) if before is None else (key, None)
                    self.add(kind, at, *ends)
                elif isinstance(before, dict) and isinstance(after, dict):
                    self.data(at, table, before, after, f"{pattern}/")
                else:
                    self.attribute(at, path.rstrip("/"), entry.added, before, after)
            elif entry is not None:
                self.attribute(where, key, entry, before, after)
            elif isinstance(before or after, dict):
                self.data(where, table, before or {}, after or {}, f"{pattern}/")
            else:
                self.attribute(where, key, "unclassified", before, after)

    def _renamed(self, kind: str, value: Any) -> Any:
        if _listed(value):
            return [self.renamed(kind, name) for name in value]
        value = _plain(value)
        return self.renamed(kind, value) if isinstance(value, str) else value


def _listed(value: object) -> bool:
    return isinstance(value, (list, tuple))


def _plain(value: Any) -> Any:
    """Return the name of a thing in the model, a tuple as the list in the YAML, or the value itself."""
    if isinstance(value, tuple):
        return list(value)
    return getattr(value, "name", value)


def _shown(value: Any, digits: int) -> str | None:
    """Return a value in readable form, with this many hex digits in integers; None if it is empty."""
    value = _plain(value)
    if value is None or value in ("", [], {}):
        return None
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and digits:
        return f"{'-' * (value < 0)}0x{abs(value):0{digits}X}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key}: {_shown(item, digits)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(_shown(item, digits) or "" for item in value)
    return str(value)

"""Add to entries of a protocol and of overlays below, rename and withdraw them, as an overlay asks.

``additions.yaml`` of an overlay has the sections of a protocol. Each entry in it holds only the new parts of
an entry that is already there: mappings are merged key by key, items are appended to lists. An addition never
changes a value; replacing an entry is an override. ``renames`` and ``withdraws`` in overlay.yaml list names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.overlays.register import Gone, Key, Register, owner
from stagewire_generator.reader import Files
from stagewire_generator.schemas import fits_schema
from stagewire_generator.strict_yaml import Document, KeyPath

_ROLES = ("SET", "REQ", "GET")
_RENAMED = ("parameter_sets", "messages")
_AS_PRINTED = ("protocol", "overlay", "printed", "decisions")  # files that keep old names


def revise(below: Files, overlay: Files, register: Register, diagnostics: Diagnostics) -> Files:
    """Return the files below an overlay after its renames, withdrawals and additions.

    :param register: the entries below, from which withdrawn and renamed ones are removed.
    """
    head = overlay["overlay"][0]
    revised = {kind: list(documents) for kind, documents in below.items()}
    for key, place in _withdrawn(head):
        if register.has(key, place, diagnostics, what_for="withdraw"):
            kind, number, _ = register.homes.pop(key)
            register.gone[key] = Gone(head.overlay)
            revised[kind][number] = _without(revised[kind][number], key)
            revised["units"] = [_unlisted(units, key) for units in revised.get("units", ())]
    for document in overlay.get("additions", ()):
        changed: dict[tuple[str, int], dict[KeyPath, Place]] = {}  # file -> where it is added to
        for key, place in added(document):
            if register.has(key, place, diagnostics, what_for="add to"):
                kind, number, _ = register.homes[key]
                merger = _Merger(revised[kind][number], document, register.members, diagnostics)
                revised[kind][number] = merger.merged(key, document.data[key[0]][key[1]])
                changed.setdefault((kind, number), {})[key] = place
        for (kind, number), places in sorted(changed.items()):
            whole = revised[kind][number]
            part = bool(whole.overlay)  # so it may lack sections
            fits_schema(whole, kind, diagnostics, part=part, places=places)
    names = dict(_renamed(head, below["protocol"][0], register, diagnostics))
    spellings = {
        old: entry["spelling"]
        for entries in head.data.get("renames", {}).values()
        for old, entry in entries.items()
        if "spelling" in entry
    }
    for kind, documents in revised.items() if names else ():
        if kind not in _AS_PRINTED:
            revised[kind] = [_with_names(document, names, spellings) for document in documents]
    return revised


def _withdrawn(head: Document) -> Iterator[tuple[Key, Place]]:
    """Yield each withdrawn entry with its position."""
    for section, names in head.data.get("withdraws", {}).items():
        for index, name in enumerate(names):
            yield (section, name), head.place("withdraws", section, index)


def added(document: Document) -> Iterator[tuple[Key, Place]]:
    """Yield each entry that an additions.yaml adds to, with its position."""
    for section, entries in document.data.items():
        for name in entries:
            yield (section, name), document.place(section, name)


def _without(document: Document, key: Key) -> Document:
    section, name = key
    kept = {n: entry for n, entry in document.data[section].items() if n != name}
    return replace(document, data={**document.data, section: kept})


def _unlisted(units: Document, withdrawn: Key) -> Document:
    """Return the units without a withdrawn message, or the set of this name, in lists and families."""
    section, name = withdrawn
    if section not in ("messages", "parameter_sets"):
        return units

    def kept(entry: dict[str, Any]) -> dict[str, Any]:
        return {
            part: [n for n in names if n != name] if part in ("messages", "completes") else names
            for part, names in entry.items()
        }

    sections = {
        part: {key: kept(entry) for key, entry in units.data[part].items()}
        for part in ("lists", "families")
        if part in units.data
    }
    return replace(units, data={**units.data, **sections})


class _Merger:
    """Merges the additions of an overlay into one file below it."""

    def __init__(
        self,
        target: Document,
        source: Document,
        members: Mapping[str, tuple[str, ...]],
        diagnostics: Diagnostics,
    ) -> None:
        self.target = target
        self.source = source
        self.members = members
        self.diagnostics = diagnostics
        self.places = dict(target.places)
        self.added: dict[KeyPath, Any] = {}  # positions in the entry of the overlay

    def merged(self, key: Key, entry: Any) -> Document:
        """Return the file with an entry added to that of the same name."""
        section, name = key
        known = self.target.data[section]
        self.added = {p: mark for p, mark in self.source.places.items() if p[:2] == key}
        whole = {**known, name: self._merged(known[name], entry, key, key)}
        sources = {**self.target.sources, self.source.name: self.source.overlay}
        data = {**self.target.data, section: whole}
        return replace(self.target, data=data, places=self.places, sources=sources)

    def _merged(self, known: Any, added: Any, at: KeyPath, to: KeyPath) -> Any:
        """Return a value with additions.

        :param at: its path in the overlay.
        :param to: its path in the file below.
        """
        if isinstance(known, dict) and isinstance(added, dict):
            whole = dict(known)
            for key, value in added.items():
                if key in known:
                    whole[key] = self._merged(known[key], value, (*at, key), (*to, key))
                else:
                    whole[key] = value
                    self._move((*at, key), (*to, key))
            return whole
        if isinstance(known, list) and isinstance(added, list):
            for index, item in enumerate(added):
                if self._has(known, item):
                    self._refuse((*at, index), f"{item} is already in the list")
                self._move((*at, index), (*to, len(known) + index))
            return [*known, *(item for item in added if item not in known)]
        for kind, noun in ((list, "a list"), (dict, "a mapping")):
            if isinstance(known, kind):
                what = f"{added!r} must be {noun}, as in {self._owner(to)}"
                self._refuse(at, what, f"write {noun} of what is new")
                return known
        if known == added:
            self._refuse(at, f"{self._owner(to)} has the same value")
        else:
            this = self.source.overlay if self.target.overlay_of(*to) else ""
            mine = f"the overlay {this}".rstrip()
            self._refuse(at, f"{self._owner(to)} has {known!r}, {mine} {added!r}")
        return known

    def _owner(self, path: KeyPath) -> str:
        """Return what the known value is from, in words."""
        return owner(self.target.overlay_of(*path))

    def _has(self, known: list[Any], item: Any) -> bool:
        """Whether a list has an item; the name of a parameter set means all its messages."""
        if not isinstance(item, str):
            return item in known
        listed = {name for entry in known for name in self.members.get(str(entry), (entry,))}
        return item in known or listed.issuperset(self.members.get(item, (item,)))

    def _move(self, at: KeyPath, to: KeyPath) -> None:
        """Take over the positions of an added value."""
        for path, mark in self.added.items():
            if path[: len(at)] == at:
                self.places[(*to, *path[len(at) :])] = mark

    def _refuse(self, at: KeyPath, what: str, hint: str = "") -> None:
        where = ".".join(str(part) for part in at)
        self.diagnostics.add(self.source.place(*at), "SW063", f"{where}: {what}", hint)


def _renamed(
    head: Document, protocol: Document, register: Register, diagnostics: Diagnostics
) -> Iterator[tuple[str, str]]:
    """Yield the old and new name of each renamed message or set, and of the messages of a set."""
    groups = protocol.data.get("groups", ())
    taken = {name for section, name in register.homes if section in _RENAMED}
    for section, names in head.data.get("renames", {}).items():
        for old, entry in names.items():
            new, place = entry["to"], head.place("renames", section, old)
            if new in taken:
                diagnostics.add(place, "SW020", f"{new}, the new name of {old}, is defined twice")
            elif register.has((section, old), place, diagnostics, what_for="rename"):
                register.gone[section, old] = Gone(head.overlay, new)
                taken.add(new)
                yield old, new
                if section == "parameter_sets":
                    for role in _ROLES:
                        yield member(old, role, groups), member(new, role, groups)


def member(name: str, role: str, groups: Any) -> str:
    """Return the name of the SET, REQ or GET of a parameter set."""
    group, _, rest = name.partition("_")
    return "_".join((group, role, rest)) if group in groups else f"{role}_{name}"


def _with_names(
    document: Document, names: Mapping[str, str], spellings: Mapping[str, str]
) -> Document:
    """Return a file with every old name replaced; the entry itself keeps the old name as an alias."""

    def of(text: str) -> str:
        owner, dot, field = text.partition(".")
        return names.get(owner, owner) + dot + field

    def renamed(value: Any) -> Any:
        if isinstance(value, dict):
            return {
                of(key) if isinstance(key, str) else key: renamed(part)
                for key, part in value.items()
            }
        if isinstance(value, list):
            return [renamed(part) for part in value]
        return of(value) if isinstance(value, str) else value

    data = renamed(document.data)
    for section in _RENAMED:
        for old in document.data.get(section, {}):
            if old in names:
                entry = data[section][names[old]]
                _, _, rest = old.partition("_")
                spelling = entry.pop("spelling", rest.lower().replace("_", " "))
                entry |= {"spelling": spellings[old]} if old in spellings else {}
                entry["also_named"] = {**entry.get("also_named", {}), old: spelling}
    places = {
        tuple(of(part) if isinstance(part, str) else part for part in path): mark
        for path, mark in document.places.items()
    }
    return replace(document, data=data, places=places)

"""Search in the registries by names, parts of names and ids, for ``stagewire show``."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from stagewire_conformance.registry import Registry

Json = dict[str, Any]

_TABLES = {
    "enumeration": "enumerations",
    "flag table": "flags",
    "quantity": "quantities",
    "unit": "units",
    "alias": "aliases",
    "unsupported unit": "unsupported",
    "stage": "stages",
    "controller": "controllers",
    "list": "lists",
    "family": "families",
    "erratum": "errata",
}
KINDS = {
    "unit": "units",
    "alias": "aliases",
    "unsupported unit": "unsupported units",
    "stage": "stages",
    "message": "messages",
    "field": "fields",
    "parameter set": "parameter sets",
    "enumeration": "enumerations",
    "flag table": "flag tables",
    "quantity": "quantities",
    "prefix": "prefixes",
    "controller": "controllers",
    "family": "families",
    "list": "lists",
    "erratum": "errata",
}
"""Each kind of entry with its plural, in the order in which people look for them."""

_ID = re.compile(r"0x[0-9a-f]+|[0-9a-f]{3,4}")
"""An id of a message, in hex, in lower case."""


class Entry(NamedTuple):
    """An entry of a registry.

    :param source: the protocol, or the file of a stage of the user.
    :param data: what the registry says.
    """

    source: str
    kind: str
    name: str
    data: Json

    @property
    def names(self) -> list[str]:
        """The name and other names, in lower case."""
        others = (*self.data.get("aliases", ()), *self.data.get("catalogue", ()))
        return [name.lower() for name in (self.name, *others)]


def entries_of(registries: Mapping[str, Registry]) -> list[Entry]:
    """Return all entries of registries, by protocol."""
    return [
        Entry(protocol, kind, name, data)
        for protocol, registry in registries.items()
        for kind, name, data in _entries(registry)
    ]


def _entries(registry: Registry) -> Iterator[tuple[str, str, Json]]:
    for name, entry in registry.messages.items():
        yield "message", name, entry
    for name, members in registry.table("sets").items():
        yield "parameter set", name, {"messages": members}
    for kind, key in _TABLES.items():
        for name, entry in registry.table(key).items():
            yield kind, name, entry
    yield from (("prefix", prefix, entry) for prefix, entry in _prefixes(registry).items())
    yield from (("field", name, entry) for name, entry in _fields(registry).items())


def _fields(registry: Registry) -> dict[str, Json]:
    """Return each field by name, with its units and the messages that have it."""
    found: dict[str, Json] = {}
    for message in registry.messages:
        for form in registry.forms(message):
            for name, field in registry.fields(message, form).items():
                entry = found.setdefault(name, {"units": [], "messages": []})
                for key, value in (("units", field.get("unit")), ("messages", message)):
                    if value and value not in entry[key]:
                        entry[key].append(value)
    return found


def _prefixes(registry: Registry) -> dict[str, Json]:
    """Return each prefix of serial numbers with the units that have it, and further known facts."""
    owners: dict[str, list[str]] = {}
    for kind in ("units", "unsupported"):
        for name, entry in registry.table(kind).items():
            own = [entry[key] for key in ("usb_prefix", "card_usb_prefix") if key in entry]
            for prefix in dict.fromkeys(map(str, [*own, *entry.get("prefixes", ())])):
                owners.setdefault(prefix, []).append(name)
    known = registry.table("known_prefixes")
    for prefix, entry in known.items():
        names = [entry["unit"], *entry.get("shared_with", ())]
        owners[prefix] = list(dict.fromkeys([*owners.get(prefix, ()), *names]))
    shown = ("distinguished_by", "source", "note")
    return {
        prefix: {
            "units": names,
            **{key: known[prefix][key] for key in shown if key in known.get(prefix, {})},
        }
        for prefix, names in owners.items()
    }


def named(name: str, everything: Sequence[Entry]) -> list[Entry]:
    """Return the entries with a name in any case, or the messages with an id such as 0453 or 0x0453."""
    wanted = name.strip().lower()
    for candidate in (wanted, wanted.partition("_")[2]):  # with and without a prefix like MGMSG_
        found = [entry for entry in everything if candidate and candidate in entry.names]
        if found:
            return found
    if not _ID.fullmatch(wanted):
        return []
    id = int(wanted, 16)
    return [entry for entry in everything if entry.kind == "message" and entry.data["id"] == id]


def of_kind(kind: str, everything: Sequence[Entry]) -> list[Entry]:
    """Return the entries of a kind, such as ``stages`` or ``flag-tables``."""
    wanted = re.sub("[-_ ]+", " ", kind.strip().lower())
    found = [one for one, plural in KINDS.items() if wanted in (one, plural)]
    return [entry for entry in everything if entry.kind in found]


def with_part(part: str, everything: Sequence[Entry]) -> list[Entry]:
    """Return the entries whose names, or whose bits or values, contain a text in any case."""
    wanted = part.strip().lower()
    return [
        entry
        for entry in everything
        if wanted
        and any(wanted in name for name in (*entry.names, *map(str.lower, _members(entry))))
    ]


def labels(entry: Entry, part: str) -> list[str]:
    """Return the name of an entry, or those of its values or bits if only they contain the text."""
    wanted = part.strip().lower()
    if any(wanted in name for name in entry.names):
        return [entry.name]
    return [f"{entry.name}.{name}" for name in _members(entry) if wanted in name.lower()] or [
        entry.name
    ]


def _members(entry: Entry) -> Iterator[str]:
    """Yield the names of the values of an enumeration, and of the bits of a flag table."""
    for key in ("values", "bits"):
        if entry.kind in ("enumeration", "flag table"):
            yield from entry.data.get(key, ())


def similar(name: str, everything: Sequence[Entry]) -> list[str]:
    """Return at most three names that a misspelled name may mean."""
    names = {name: entry.name for entry in everything for name in entry.names}
    close = difflib.get_close_matches(name.lower()[:80], names, n=3)
    return list(dict.fromkeys(names[word] for word in close))

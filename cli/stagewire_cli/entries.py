"""Entries of the registries, and how ``stagewire show`` finds them by a name or a part of it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
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
_ID = re.compile(r"0x[0-9a-f]{1,4}|[0-9a-f]{4}")


class Entry(NamedTuple):
    """An entry of a registry.

    :param protocol: name of its protocol.
    :param kind: such as ``message`` or ``parameter set``; ``field`` for the messages with a field.
    """

    protocol: str
    kind: str
    name: str
    facts: Json

    def names(self) -> list[str]:
        """Return its name and its other names, in lower case."""
        others = (*self.facts.get("aliases", ()), *self.facts.get("catalogue", ()))
        return [name.lower() for name in (self.name, *others)]


def entries_of(protocol: str, registry: Registry) -> Iterator[Entry]:
    """Yield all entries of a registry, by kind."""
    fields: dict[str, list[str]] = {}
    for name, facts in registry.messages.items():
        yield Entry(protocol, "message", name, facts)
        for field in {field["name"] for layout in facts["layouts"] for field in layout["fields"]}:
            fields.setdefault(field, []).append(name)
    for name, members in registry.table("sets").items():
        yield Entry(protocol, "parameter set", name, {"messages": members})
    for kind, key in _TABLES.items():
        for name, facts in registry.table(key).items():
            yield Entry(protocol, kind, name, facts)
    for prefix, facts in _prefixes(registry).items():
        yield Entry(protocol, "prefix", prefix, facts)
    for name, messages in sorted(fields.items()):
        yield Entry(protocol, "field", name, {"messages": messages})


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


def named(text: str, entries: list[Entry]) -> list[Entry]:
    """Return the entries with a name, in any case, or the message with an id such as 0453 or 0x0453."""
    wanted = text.strip().lower()
    for name in (wanted, wanted.partition("_")[2]):  # with and without a prefix like MGMSG_
        found = [entry for entry in entries if name and name in entry.names()]
        if found:
            # A name of its own kind comes before a field with the same name.
            return [entry for entry in found if entry.kind != "field"] or found
    if not _ID.fullmatch(wanted):
        return []
    number = int(wanted, 16)
    return [entry for entry in entries if entry.kind == "message" and entry.facts["id"] == number]


def containing(text: str, entries: list[Entry]) -> list[Entry]:
    """Return the entries whose names contain all words of a text, in any case."""
    words = text.lower().split()
    return [
        entry
        for entry in entries
        if any(all(word in name for word in words) for name in entry.names())
    ]


def similar(text: str, entries: list[Entry]) -> list[str]:
    """Return up to three names that a user may have meant."""
    names = {name: entry.name for entry in entries for name in entry.names()}
    close = difflib.get_close_matches(text.lower()[:80], names, n=3)
    return [names[name] for name in close]

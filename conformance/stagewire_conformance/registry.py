"""The resolved registry of a protocol as data, and the rules of its document that may concern a check."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, Final

from stagewire.protocols import Protocol

Json = dict[str, Any]

PLAIN: Final = "data"
"""The form that is sent of a message with packets of several lengths."""


class Registry:
    """An index of the JSON of one protocol's registry. It computes nothing."""

    def __init__(self, data: Json) -> None:
        self.data = data
        self.messages: dict[str, Json] = {entry["name"]: entry for entry in data["messages"]}

    def layout(self, message: str, form: str) -> Json | None:
        """Return the layout of a message by its form, or None."""
        entry = self.messages.get(message)
        if entry is None:
            return None
        found: Json | None
        found = next((item for item in entry["layouts"] if item["form"] == form), None)
        return found

    def fields(self, message: str, form: str, unit: str = "") -> dict[str, Json]:
        """Return header parameters and payload fields of a layout by name, in wire order.

        :param unit: the unit whose ranges apply; empty for ranges that include those of all units.
        """
        layout = self.layout(message, form)
        found = {} if layout is None else dict(_named(layout))
        return {name: _on(unit, field) for name, field in found.items()} if unit else found

    @property
    def axes(self) -> dict[str, Json]:
        """The documented axes by name, each with its identifier as ``value``.

        Empty if messages have addresses.
        """
        name = self.data["framing"].get("axes")
        values: dict[str, Json] = self.table("enumerations")[name]["values"] if name else {}
        return values

    def document(self, overlay: str = "") -> Json:
        """Return the document of an overlay, or of the protocol itself for an empty name."""
        found: Json = self.data["document"]
        for entry in found.get("overlays", ()) if overlay else ():
            if entry["name"] == overlay:
                found = entry["document"]
        return found

    def overlay_of(self, entry: Json) -> str:
        """Return the overlay whose document has the page of an entry; empty for that of the protocol."""
        for overlay in self.document().get("overlays", ()):
            if overlay["document"]["name"] == entry.get("document"):
                return str(overlay["name"])
        return ""

    def order(self, entry: Json) -> tuple[int, int]:
        """Return the position of an entry with a page in the documents: first that of the protocol."""
        overlays = [overlay["name"] for overlay in self.document().get("overlays", ())]
        return ["", *overlays].index(self.overlay_of(entry)), int(entry["page"])

    def forms(self, message: str) -> list[str]:
        """Return the forms of a message; empty for an unknown one."""
        return [layout["form"] for layout in self.messages.get(message, {}).get("layouts", ())]

    def where(self, pages: Iterable[int], overlay: str = "") -> str:
        """Return a reference into a document, such as ``page 45`` or ``Issue 37, page 58``.

        The document is named only if there are several. If it has no pages, its sections are named.

        :param overlay: the overlay whose document has these pages.
        """
        document = self.document(overlay)
        sections = document.get("sections")
        of = f"{document['name']}, " if "name" in document else ""
        if sections is None:
            return f"{of}page {', '.join(str(page) for page in pages)}"
        return f"{of}section {', '.join(sections[page - 1] for page in pages)}"

    def table(self, kind: str) -> dict[str, Json]:
        """Return a part of the registry, such as ``units`` or ``errata``, by name."""
        part = self.data.get(kind) or {}
        if isinstance(part, dict):
            return part
        return {entry.get("name", entry.get("id")): entry for entry in part}


def _named(layout: Json) -> Iterator[tuple[str, Json]]:
    for key in ("param1", "param2"):
        if layout.get(key):
            yield layout[key].get("name") or key, layout[key]
    for field in layout["fields"]:
        yield field["name"], field


def _on(unit: str, field: Json) -> Json:
    """Return a field with the range that it has on a unit."""
    ranges = field.get("ranges_by_unit")
    return field if ranges is None else {**field, **ranges.get(unit, ranges["others"])}


@cache
def registry_of(protocol: Protocol) -> Registry:
    """Return the registry of an installed protocol. It is read only once."""
    return Registry(protocol.registry())


_OF_BAYS: Final = frozenset(
    {
        "one-line-for-bays", "motherboard-address", "slot-addressed-by-destination", "slot-source",
        "bays-are-single-channel", "bay-used", "bay-idents", "bay-states",
    }
)  # fmt: skip
"""Rules of APT that concern only units with bays."""
_OF_OTHERS: Final = frozenset({"generic-unit-address"})
"""Rules of APT that concern only units without bays."""


def about(
    registry: Registry, rules: Iterable[str], messages: Iterable[str], *, bays: bool | None = None
) -> tuple[str, ...]:
    """Return the rules about at least one of the messages, and the rules about no or all messages.

    Without messages return all rules. Unknown names are kept; ``rules_page.unknown_rules`` finds them.

    :param bays: whether the unit has bays; rules for other units are omitted. None if unknown.
    """
    known, wanted = known_rules(registry), set(messages)
    others: frozenset[str] = frozenset() if bays is None else _OF_OTHERS if bays else _OF_BAYS
    return tuple(
        rule
        for rule in rules
        if rule not in others
        and (
            not (wanted and rule in known and known[rule]["messages"])
            or not wanted.isdisjoint(known[rule]["messages"])
        )
    )


@cache
def known_rules(registry: Registry) -> dict[str, Json]:
    """Return the rules of a registry by their slugs."""
    return {rule["id"]: rule for rule in registry.data.get("rules", ())}

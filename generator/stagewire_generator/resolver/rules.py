"""What the document demands beside the layouts of messages."""

from __future__ import annotations

from stagewire_generator.model import Rule
from stagewire_generator.resolver.tables import Tables

__all__ = ["define_rules"]


def define_rules(tables: Tables) -> None:
    """Fill the table of rules; the messages and errata that they name are looked up."""
    for document, id, entry, place in tables.entries("rules", "rules", tables.rules):
        at = ("rules", id)
        for index, name in enumerate(entry.get("messages", ())):
            tables.look_up(tables.messages, name, "message", document.place(*at, "messages", index))
        for index, slug in enumerate(entry.get("errata", ())):
            tables.look_up(tables.errata, slug, "erratum", document.place(*at, "errata", index))
        tables.rules[id] = Rule(
            id=id,
            page=entry["page"],
            also=tuple(entry.get("also", ())),
            strength=entry["strength"],
            subject=entry["subject"],
            says=entry["says"],
            means=entry.get("means", ""),
            messages=tuple(entry.get("messages", ())),
            errata=tuple(entry.get("errata", ())),
            waiver=entry.get("waiver", ""),
            place=place,
            overlay=document.overlay,
        )

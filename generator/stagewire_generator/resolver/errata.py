"""Errata, and the messages and fields that they name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Erratum, Field, Json, Layout, Message
from stagewire_generator.resolver.tables import Tables

__all__ = ["define_errata", "with_errata"]


def define_errata(tables: Tables) -> None:
    """Fill the table of errata, and that of the messages and fields that they name."""
    for document, id, entry, place in tables.entries("errata", "errata", tables.errata):
        erratum = _erratum(id, entry, place, document.overlay)
        tables.errata[id] = erratum
        for name in (*erratum.messages, *erratum.fields):
            tables.errata_of.setdefault(name, set()).add(id)


def with_errata(tables: Tables, message: Message) -> Message:
    """Return the message with its errata and those of its fields, which name it or its set.

    What the document of the protocol says wrongly of a message that an overlay replaces is not said
    of the message that takes its place.
    """
    owners = {message.name} | ({message.set[0]} if message.set else set())

    def of(*names: str) -> tuple[str, ...]:
        found = {id for name in names for id in tables.errata_of.get(name, ())}
        own = {id for id in found if message.overlay in ("", tables.errata[id].overlay)}
        return tuple(sorted(own))

    def marked(field: Field) -> Field:
        found = of(*(f"{owner}.{field.name}" for owner in owners))
        return replace(field, errata=found) if found else field

    layouts = tuple(_with_fields(layout, marked) for layout in message.layouts)
    return replace(message, layouts=layouts, errata=of(message.name))


def _with_fields(layout: Layout, marked: Callable[[Field], Field]) -> Layout:
    return replace(
        layout,
        param1=layout.param1 and marked(layout.param1),
        param2=layout.param2 and marked(layout.param2),
        fields=tuple(marked(field) for field in layout.fields),
    )


def _erratum(id: str, entry: Json, place: Place, overlay: str) -> Erratum:
    return Erratum(
        id=id,
        pages=tuple(entry["pages"]),
        subject=entry["subject"],
        messages=tuple(entry.get("messages", ())),
        fields=tuple(entry.get("fields", ())),
        printed=str(entry["printed"]),
        encoded=str(entry["encoded"]),
        evidence=entry["evidence"],
        kind=entry["class"],
        origin=entry["origin"],
        places=tuple(entry.get("places", ())),
        place=place,
        overlay=overlay,
    )

"""What messages refer to: chapters, enumerations, flag tables, blocks, versions of the firmware."""

from __future__ import annotations

from stagewire_generator.model import (
    Chapter,
    Enumeration,
    EnumValue,
    Firmware,
    FlagBit,
    FlagTable,
    Json,
)
from stagewire_generator.naming import can_name_chapter
from stagewire_generator.resolver.tables import Tables

__all__ = ["define_blocks", "define_chapters", "define_enumerations", "define_flags", "firmware"]


def define_chapters(tables: Tables) -> None:
    """Fill the table of chapters; files that share one describe it alike, or leave it to another."""
    for document in tables.files.get("messages", []):
        data, place = document.data, document.place("chapter")
        name = data["chapter"]
        if not can_name_chapter(name):
            tables.diagnostics.add(place, "SW023", f"{name} is reserved as the name of a module")
        if "title" not in data:
            continue
        summary, overlay = data.get("summary", ""), document.overlay
        chapter = Chapter(name, data["title"], data["page"], data["order"], summary, overlay)
        if tables.chapters.setdefault(name, chapter) != chapter:
            what = f"the chapter {name} is described otherwise in another file"
            tables.diagnostics.add(place, "SW020", what)
    for document in tables.files.get("messages", []):
        name, place = document.data["chapter"], document.place("chapter")
        if name not in tables.chapters:
            what, hint = f"no file describes the chapter {name}", "give its title, page and order"
            tables.diagnostics.add(place, "SW021", what, hint)


def define_enumerations(tables: Tables) -> None:
    """Fill the table of enumerations."""
    entries = tables.entries("messages", "enumerations", tables.enumerations)
    for document, name, entry, place in entries:
        values = tuple(
            EnumValue(
                key,
                value["value"],
                value.get("note", ""),
                value.get("keyboard", ""),
                value.get("reserved", False),
                value.get("modifier", False),
                value.get("hinders", {}),
            )
            for key, value in entry["values"].items()
        )
        summary = entry.get("summary", "")
        tables.enumerations[name] = Enumeration(
            name,
            entry["page"],
            summary,
            values,
            place,
            document.overlay,
            entry.get("open", ""),
        )


def define_flags(tables: Tables) -> None:
    """Fill the table of flag tables; one of an unknown format is left out."""
    for document, name, entry, place in tables.entries("messages", "flags", tables.flags):
        format = tables.format(entry["format"], place)
        if format is None:
            continue
        bits = tuple(
            FlagBit(
                key,
                bit["bit"],
                bit.get("note", ""),
                bit.get("motion", False),
                bit.get("hinders", {}),
            )
            for key, bit in entry["bits"].items()
        )
        summary = entry.get("summary", "")
        tables.flags[name] = FlagTable(
            name,
            entry["page"],
            summary,
            format,
            bits,
            place,
            document.overlay,
            entry.get("open", ""),
        )


def define_blocks(tables: Tables) -> None:
    """Fill the table of blocks: lists of fields that layouts share, each with where it stands."""
    for document, name, entry, _ in tables.entries("messages", "blocks", tables.blocks):
        tables.blocks[name] = (document, ("blocks", name), entry)


def firmware(entry: Json) -> tuple[Firmware, ...]:
    """Return what a protocol or a command says of versions of the firmware."""
    return tuple(
        Firmware(fact["version"], fact["note"], fact.get("page"))
        for fact in entry.get("firmware", ())
    )

"""Tables of resolved definitions, by name, and the look-ups in them.

Messages refer to chapters, enumerations, flag tables, blocks and versions of the firmware. A name divides
into its group and the words as the document spells them.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from typing import TypeVar

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.model import (
    Chapter,
    Enumeration,
    EnumValue,
    Erratum,
    Firmware,
    FlagBit,
    FlagTable,
    Format,
    Json,
    Message,
    ParameterSet,
    Quantity,
    Rule,
)
from stagewire_generator.naming import can_name_chapter
from stagewire_generator.strict_yaml import Document, KeyPath

_FORMAT = re.compile(r"([a-z][a-z0-9]*)(?:\[([1-9][0-9]{0,2})\])?\Z")

T = TypeVar("T")


class Tables:
    """The files of one protocol, and a table for each kind of thing that is made from them.

    :param files: the files, sorted by kind.
    :param diagnostics: where whatever cannot be resolved is noted.
    """

    def __init__(self, files: Mapping[str, list[Document]], diagnostics: Diagnostics) -> None:
        self.files = files
        self.diagnostics = diagnostics
        self.head = files["protocol"][0]
        self.formats: Json = self.head.data["formats"]
        self.quantities: dict[str, Quantity] = {}
        self.enumerations: dict[str, Enumeration] = {}
        self.flags: dict[str, FlagTable] = {}
        self.blocks: dict[str, tuple[Document, KeyPath, Json]] = {}
        self.messages: dict[str, Message] = {}
        self.sets: dict[str, ParameterSet] = {}
        self.chapters: dict[str, Chapter] = {}
        self.errata: dict[str, Erratum] = {}
        self.rules: dict[str, Rule] = {}
        self.errata_of: dict[str, set[str]] = {}  # MESSAGE or MESSAGE.field -> slugs

    def entries(
        self, kind: str, section: str, table: Mapping[str, object]
    ) -> Iterator[tuple[Document, str, Json, Place]]:
        """Yield each entry of ``section`` in the files of a kind; a name counts once.

        :param table: what is made of the entries; whoever asks fills it in between.
        """
        for document in self.files.get(kind, []):
            for name, entry in document.data.get(section, {}).items():
                place = document.place(section, name)
                if name in table:
                    self.diagnostics.add(place, "SW020", f"{name} is defined twice")
                else:
                    yield document, name, entry, place

    def look_up(self, table: Mapping[str, T], name: str, kind: str, place: Place) -> T | None:
        """Return what a name stands for; None, and a diagnostic, where nothing defines it."""
        found = table.get(name)
        if found is None:
            close = difflib.get_close_matches(name, table, cutoff=0.5)
            hint = f"did you mean {' or '.join(close)}?" if close else ""
            self.diagnostics.add(place, "SW021", f"no {kind} is named {name}", hint)
        return found

    def format(self, text: str, place: Place) -> Format | None:
        """Return the format that is written ``word`` or ``char[8]``; None where there is none."""
        match = _FORMAT.match(text)
        entry = self.formats.get(match[1]) if match else None
        if match is None or entry is None:
            known = ", ".join(self.formats)
            self.diagnostics.add(place, "SW021", f"no format is named {text} (there are: {known})")
            return None
        count = int(match[2]) if match[2] else None
        if count is None:
            return Format(text, entry["size"], entry["signed"], "integer")
        kind = "text" if match[1] == "char" else "bytes"
        return Format(text, count * entry["size"], False, kind)


def split_group(tables: Tables, name: str) -> tuple[str, str]:
    """Return the group that a name begins with, or an empty text, and the rest of the name."""
    group, _, rest = name.partition("_")
    return (group, rest) if group in tables.head.data.get("groups", ()) else ("", name)


def spelling_of(entry: Json, rest: str) -> str:
    """Return the words of a name without its group: as the entry spells them, or divided by underscores."""
    spelling: str = entry.get("spelling", rest.lower().replace("_", " "))
    return spelling


def joined(group: str, verb: str, spelling: str) -> tuple[str, ...]:
    """Return the words of a name: its group, SET, REQ or GET, and what the entry spells."""
    return tuple(w for w in (group.lower(), verb, *spelling.split()) if w)


def spelled_words(
    tables: Tables, group: str, spelling: str, name: str, place: Place
) -> tuple[str, ...]:
    """Return the words of a name as it stands in a file; a diagnostic where, joined, they do not give it."""
    words = joined(group, "", spelling)
    if not _spell(words, name):
        first, _, rest = name.partition("_")
        hint = ""
        if not group and rest and _spell(words, rest):
            hint = (
                f"list {first} under `groups`, in protocol.yaml or overlay.yaml, or spell it, too"
            )
        tables.diagnostics.add(place, "SW024", f"{' '.join(words)} does not spell {name}", hint)
    return words


def _spell(words: tuple[str, ...], name: str) -> bool:
    return "".join(words) == name.lower().replace("_", "")


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

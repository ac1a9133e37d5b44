"""Tables of resolved definitions by name, with look-ups.

Messages refer to chapters, enumerations, flag tables, blocks and firmware versions. A name consists of its
group and the words as the document spells them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TypeVar

from stagewire_generator.diagnostics import Diagnostics, Place, meant
from stagewire_generator.model import Chapter, Erratum, Firmware, Json, Message, ParameterSet, Rule
from stagewire_generator.model_fields import Enumeration, EnumValue, FlagBit, FlagTable, Format
from stagewire_generator.model_scales import (
    Quantity,
)
from stagewire_generator.naming import can_name_chapter
from stagewire_generator.real import SIZES
from stagewire_generator.strict_yaml import Document, KeyPath

_FORMAT = re.compile(r"([a-z][a-z0-9]*)(?:\[([1-9][0-9]{0,2})\])?\Z")

T = TypeVar("T")


class Tables:
    """The files of one protocol, and a table for each kind of definition in them.

    :param files: the files by kind.
    :param diagnostics: receives an error for each entry that cannot be resolved.
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
        self.aliases: set[str] = set()  # other names of messages
        self.sets: dict[str, ParameterSet] = {}
        self.chapters: dict[str, Chapter] = {}
        self.errata: dict[str, Erratum] = {}
        self.rules: dict[str, Rule] = {}
        self.errata_of: dict[str, set[str]] = {}  # MESSAGE or MESSAGE.field -> slugs
        self.errata_owners: set[str] = set()  # the messages and sets of these names
        self._found: dict[str, Format] = {}
        self.under: dict[str, frozenset[str]] = {}  # overlay -> those that it builds on
        for head in files.get("overlay", ()):
            named = head.data.get("builds_on", ())
            self.under[head.overlay] = frozenset(named).union(*(self.under[name] for name in named))

    @property
    def top(self) -> str:
        """The overlay that was applied last; empty if there is none."""
        return next(reversed(self.under), "")

    def entries(
        self, kind: str, section: str, table: Mapping[str, object]
    ) -> Iterator[tuple[Document, str, Json, Place]]:
        """Yield each entry of ``section`` in the files of a kind; report duplicate names.

        :param table: the resolved entries, which the caller fills during the iteration.
        """
        for document in self.files.get(kind, []):
            for name, entry in document.data.get(section, {}).items():
                place = document.place(section, name)
                if name in table:
                    self.diagnostics.add(place, "SW020", f"{name} is defined twice")
                else:
                    yield document, name, entry, place

    def look_up(self, table: Mapping[str, T], name: str, kind: str, place: Place) -> T | None:
        """Return the definition of a name, or None, with a diagnostic, if it is undefined."""
        found = table.get(name)
        if found is None:
            what = f"unknown {kind} {name}"
            self.diagnostics.add(place, "SW021", what, meant(name, table))
        return found

    def repeated(self, text: str) -> tuple[str, int] | None:
        """Return the format and the number of integers in ``word[16]``; None for other formats."""
        match = _FORMAT.match(text)
        entry = self.formats.get(match[1]) if match else None
        if match is None or entry is None or not match[2] or entry["size"] == 1:
            return None
        return match[1], int(match[2])

    def format(self, text: str, place: Place) -> Format | None:
        """Return the format written as ``word`` or ``char[8]``, or None if it is unknown."""
        if text in self._found:
            return self._found[text]
        match = _FORMAT.match(text)
        entry = self.formats.get(match[1]) if match else None
        if match is None or entry is None:
            known = ", ".join(self.formats)
            self.diagnostics.add(place, "SW021", f"unknown format {text} (known formats: {known})")
            return None
        count = int(match[2]) if match[2] else None
        if count is None:
            real = entry.get("real", False)
            if real and (entry["size"] not in SIZES or entry["signed"]):
                what = f"the format {text} is not supported: a real number has 4 or 8 bytes and is unsigned"
                self.diagnostics.add(place, "SW033", what, "correct its size, or remove `real`")
                real = False
            found = Format(text, entry["size"], entry["signed"], "integer", real)
            return self._found.setdefault(text, found)
        if entry["size"] > 1:
            what = (
                f"the format {text} is not supported here: only formats of one byte can be repeated"
            )
            hint = f"use the format {match[1]}, or raw bytes"
            self.diagnostics.add(place, "SW033", what, hint)
            return None
        kind = "text" if match[1] == "char" else "bytes"
        return self._found.setdefault(text, Format(text, count * entry["size"], False, kind))


def split_group(tables: Tables, name: str) -> tuple[str, str]:
    """Return the group at the beginning of a name, or an empty text, and the rest of the name."""
    group, _, rest = name.partition("_")
    return (group, rest) if group in tables.head.data.get("groups", ()) else ("", name)


def spelling_of(entry: Json, rest: str) -> str:
    """Return the words of a name without its group: its ``spelling``, or split at underscores."""
    spelling: str = entry.get("spelling", rest.lower().replace("_", " "))
    return spelling


def joined(group: str, verb: str, spelling: str) -> tuple[str, ...]:
    """Return the words of a name: its group, SET, REQ or GET, and its spelling."""
    return tuple(w for w in (group.lower(), verb, *spelling.split()) if w)


def spelled_words(
    tables: Tables, group: str, spelling: str, name: str, place: Place
) -> tuple[str, ...]:
    """Return the words of a name in a file; report words that, when joined, do not equal the name."""
    words = joined(group, "", spelling)
    if not _spell(words, name):
        first, _, rest = name.partition("_")
        hint = ""
        if not group and rest and _spell(words, rest):
            hint = f"list {first} under `groups` in protocol.yaml or overlay.yaml, or add it to the spelling"
        tables.diagnostics.add(place, "SW024", f"{' '.join(words)} does not spell {name}", hint)
    return words


def _spell(words: tuple[str, ...], name: str) -> bool:
    return "".join(words) == name.lower().replace("_", "")


def define_chapters(tables: Tables) -> None:
    """Fill the table of chapters; files of the same chapter must agree, or only one describes it."""
    for document in tables.files.get("messages", []):
        data, place = document.data, document.place("chapter")
        name = data["chapter"]
        if not can_name_chapter(name):
            tables.diagnostics.add(place, "SW023", f"{name} is a reserved module name")
        if "title" not in data:
            continue
        summary, overlay = data.get("summary", ""), document.overlay
        chapter = Chapter(name, data["title"], data["page"], data["order"], summary, overlay)
        if tables.chapters.setdefault(name, chapter) != chapter:
            what = f"the chapter {name} is described differently in another file"
            tables.diagnostics.add(place, "SW020", what)
    for document in tables.files.get("messages", []):
        name, place = document.data["chapter"], document.place("chapter")
        if name not in tables.chapters:
            what, hint = f"no file describes the chapter {name}", "add its title, page and order"
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
                value.get("symbol", ""),
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
    """Fill the table of flag tables, without those of an unknown format."""
    all_bits = {
        name: _bits(entry["bits"])
        for document in tables.files.get("messages", ())
        for name, entry in document.data.get("flags", {}).items()
        if "bits" in entry
    }
    for document, name, entry, place in tables.entries("messages", "flags", tables.flags):
        format = tables.format(entry["format"], place)
        if format is None:
            continue
        bits = list(all_bits.get(name, {}).values())
        if "subset" in entry:
            at = document.place("flags", name, "subset")
            whole = tables.look_up(all_bits, entry["subset"]["of"], "table with bits:", at) or {}
            found = [
                tables.look_up(whole, bit, "bit", at) for bit in entry["subset"]["bits"] if whole
            ]
            bits = sorted([*filter(None, found), *bits], key=lambda bit: bit.bit)
        summary = entry.get("summary", "")
        tables.flags[name] = FlagTable(
            name,
            entry["page"],
            summary,
            format,
            tuple(bits),
            place,
            document.overlay,
            entry.get("open", ""),
        )


def _bits(entries: Json) -> dict[str, FlagBit]:
    """Return the bits of a flag table by name."""
    return {
        key: FlagBit(
            key,
            bit["bit"],
            bit.get("note", ""),
            bit.get("motion", False),
            bit.get("hinders", {}),
            bit.get("symbol", ""),
        )
        for key, bit in entries.items()
    }


def define_blocks(tables: Tables) -> None:
    """Fill the table of blocks, which are lists of fields that layouts share, each with its position."""
    for document, name, entry, _ in tables.entries("messages", "blocks", tables.blocks):
        tables.blocks[name] = (document, ("blocks", name), entry)


def firmware(entry: Json) -> tuple[Firmware, ...]:
    """Return the notes on firmware versions of a protocol or command."""
    return tuple(
        Firmware(fact["version"], fact["note"], fact.get("page"))
        for fact in entry.get("firmware", ())
    )

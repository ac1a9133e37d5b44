"""What is resolved so far, by name, and the look-ups in it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from typing import TypeVar

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.model import (
    Chapter,
    Enumeration,
    Erratum,
    FlagTable,
    Format,
    Json,
    Message,
    ParameterSet,
    Quantity,
    Rule,
)
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["Tables"]

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

"""The part of the resolved registry with evidence: sources other than the document, and what they show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from stagewire_generator.diagnostics import Place

Json = dict[str, Any]

DOCUMENT_ONLY = "document_only"
"""The class of a fact without evidence."""
CLASSES = ("hardware_trial", "hardware_frames", "vendor_program", "independent_driver")
"""All other classes, those with the most weight first."""


@dataclass(frozen=True, slots=True)
class Source:
    """A source of evidence: a file in a repository at a commit, or a version of a program."""

    id: str
    kind: str  # one of the classes
    data: Json  # repository, path, commit; program, version; note
    cited_as: str  # words in the source or note of a scale or limit that cite it; empty if none do
    place: Place
    overlay: str = ""

    @property
    def text(self) -> str:
        """The reference to it, in one line."""
        file = [self.data[key] for key in ("repository", "path") if key in self.data]
        parts = [" ".join(self.data[key] for key in ("program", "version") if key in self.data)]
        parts += ["/".join(file)]
        parts += [f"commit {self.data['commit']}" if "commit" in self.data else ""]
        return ", ".join(filter(None, parts))


@dataclass(frozen=True, slots=True)
class Evidence:
    """One source that supports an entry, or a part of it."""

    source: Source
    part: str  # keys in the entry, such as layouts/data_long; empty for the whole entry
    shows: str


@dataclass(frozen=True, slots=True)
class EvidenceTable:
    """The evidence of all entries."""

    sources: tuple[Source, ...] = ()
    of_entries: Mapping[tuple[str, str], tuple[Evidence, ...]] = field(default_factory=dict)

    def of(self, section: str, name: str) -> tuple[Evidence, ...]:
        """Return the evidence of an entry; empty if it rests on the document alone.

        :param section: the part of the resolved registry, such as ``messages`` or ``stages``.
        """
        return self.of_entries.get((section, name), ())

    def classes(self, section: str, name: str, part: str = "") -> tuple[str, ...]:
        """Return the classes of the evidence of an entry.

        :param part: a part of it; evidence of other parts is then left out.
        """
        found = self.of(section, name)
        kept = [one for one in found if not part or one.part in ("", part)]
        return ordered(evidence.source.kind for evidence in kept)

    def cited(self, *texts: str) -> tuple[Source, ...]:
        """Return the sources that texts cite: the source and the note of a scale or limit."""
        flowed = [" ".join(text.split()) for text in texts]
        return tuple(
            source
            for source in self.sources
            if source.cited_as and any(source.cited_as in text for text in flowed)
        )

    def classes_of(self, *texts: str) -> tuple[str, ...]:
        """Return the classes of the sources that texts cite."""
        return ordered(source.kind for source in self.cited(*texts))


def ordered(classes: Iterable[str]) -> tuple[str, ...]:
    """Return classes without duplicates, those with the most weight first."""
    return tuple(sorted(set(classes), key=CLASSES.index))


def spelled(classes: Iterable[str]) -> str:
    """Return classes for readers, such as ``vendor program and independent driver``."""
    return " and ".join(name.replace("_", " ") for name in classes)

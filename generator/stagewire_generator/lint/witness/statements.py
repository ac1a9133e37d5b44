"""Compare facts that are stated twice: a statement of the document, or a decision, with the registry.

Lists and tables of the document have chapters of their own. A fact in a sentence is transcribed as a
statement: its line, the printed words, and the value of the registry that they mean. A fact that the document
does not state is a decision, with a reason. Both name facts by their path in the files of the registry, such
as ``units/TDC001/channels``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from itertools import chain
from typing import Any

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.model import Json, Protocol
from stagewire_generator.strict_yaml import Document

CHAPTER = "statements"
OF_REGISTRY = ("protocol", "messages", "units", "quantities", "stages")
"""The kinds of files with facts that a statement can name."""

Found = tuple[str, Json]  # the path of the holder of a fact, and the holder


def compare_statements(
    comparison: Comparison, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Compare the statements of the document with the registry, as places ``statements/PATH``."""
    facts = Facts(comparison.protocol, files)
    for document in files.get("printed", []):
        comparison.document = document
        for index, entry in enumerate(document.data.get(CHAPTER, ())):
            for pattern, value in entry["states"].items():
                path = (CHAPTER, index, "states", pattern)
                for at, key, holder in facts.at(pattern, document, path, diagnostics):
                    place = "/".join(filter(None, (CHAPTER, at, key)))
                    comparison.same(place, path, *facts.sides(value, holder.get(key, NOTHING)))
                    if "printed" in holder and key != "printed":
                        words = entry["words"], holder["printed"]
                        comparison.same(f"{place}/words", path, *words)


def check_decisions(
    comparison: Comparison, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Check that the registry has the values that the decisions state."""
    facts = Facts(comparison.protocol, files)
    for document in files.get("decisions", []):
        for slug, entry in document.data["decisions"].items():
            for pattern, value in entry["states"].items():
                path = ("decisions", slug, "states", pattern)
                for at, key, holder in facts.at(pattern, document, path, diagnostics):
                    decided, encoded = facts.sides(value, holder.get(key, NOTHING))
                    if decided != encoded:
                        fact = "/".join(filter(None, (at, key)))
                        what = f"{fact}: {slug} states {decided}, but the registry has {encoded}"
                        diagnostics.add(document.place(*path), "SW048", what)


class Facts:
    """The files of a registry, where facts are found by their paths."""

    def __init__(self, protocol: Protocol, files: Mapping[str, list[Document]]) -> None:
        self.messages = protocol.messages
        self.roots = [document.data for kind in OF_REGISTRY for document in files.get(kind, [])]

    def at(
        self,
        pattern: str,
        document: Document,
        path: tuple[str | int, ...],
        diagnostics: Diagnostics,
    ) -> Iterator[tuple[str, str, Json]]:
        """Yield path, key and holder of each fact that a pattern names; the holder may lack the key.

        In each part of a pattern, ``*`` and ``?`` match as in file names, and ``|`` separates alternatives.
        An alternative that matches nothing is an error at this path of the document. The last part is a key,
        which each holder must have. A pattern of one part names a key at the top of a file.
        """
        *parts, last = pattern.split("/")
        roots = self.roots if parts else [r for r in self.roots if last in r] or self.roots[:1]
        found: list[Found] = [("", root) for root in roots]
        for part in parts:
            below, unmatched = _below(found, part)
            for wanted in unmatched:
                what = f"{pattern}: the registry has nothing that {wanted} names"
                diagnostics.add(document.place(*path), "SW049", what)
            if unmatched:
                return
            found = below
        for at, holder in found:
            for key in last.split("|"):
                yield at, key, holder

    def sides(self, stated: Any, encoded: Any) -> tuple[str, str]:
        """Return a stated and an encoded value as texts, which are equal if the values are.

        Numbers have several spellings, and lists any order. Of two lists, only the differences are shown. A
        mapping is compared by its keys.
        """
        if isinstance(stated, dict):
            stated = self._on_pages(stated)
        if isinstance(encoded, dict):
            encoded = [*encoded]
        if isinstance(stated, list) and isinstance(encoded, list):
            one, other = Counter(map(str, stated)), Counter(map(str, encoded))
            return _listed(one - other), _listed(other - one)
        return _text(stated), _text(encoded)

    def _on_pages(self, stated: Json) -> list[str]:
        """Return the messages that begin on some pages, and others, except some."""
        pages = {page for run in stated["pages"] for page in _pages(str(run))}
        names = {message.name for message in self.messages if message.pages[0] in pages}
        return sorted((names | {*stated.get("with", ())}) - {*stated.get("without", ())})


def _pages(run: str) -> Iterable[int]:
    """Return the pages of a run such as ``28-39`` or ``41``."""
    first, _, last = run.partition("-")
    return range(int(first), int(last or first) + 1)


def _below(found: Iterable[Found], part: str) -> tuple[list[Found], list[str]]:
    """Return the mappings one level below others whose names match, and the alternatives that match none."""
    below = [
        (f"{at}/{key}".lstrip("/"), key, inner)
        for at, holder in found
        for key, inner in holder.items()
        if isinstance(inner, dict)
    ]
    matched = {
        wanted: [(at, inner) for at, key, inner in below if fnmatchcase(key, wanted)]
        for wanted in part.split("|")
    }
    return list(chain(*matched.values())), [wanted for wanted in matched if not matched[wanted]]


def _listed(members: Counter[str]) -> str:
    return ", ".join(sorted(members.elements())) or NOTHING


def _text(value: Any) -> str:
    if isinstance(value, list):
        return _listed(Counter(map(str, value)))
    return str(value).lower() if isinstance(value, bool) else str(value)

"""Compare facts that are stated twice: a statement of the document, or a decision, with the registry.

Lists and tables of the document have chapters of their own. A fact in a sentence is transcribed as a
statement: its line, the printed words, and the value of the registry that they mean. A fact that the document
does not state is a decision, with a reason. Both name facts by their path in the files of the registry, such
as ``units/TDC001/channels``. With ``witness: complete``, a fact without any of these is an error.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase, translate
from fractions import Fraction
from typing import Any

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.model import Json, Protocol
from stagewire_generator.scales import RATIONAL
from stagewire_generator.strict_yaml import Document, KeyPath

CHAPTER = "statements"
OF_REGISTRY = ("protocol", "messages", "units", "quantities", "stages")
"""The kinds of files with facts that a statement can name."""

Found = tuple[str, Json, bool]  # a path, the mapping there, and whether a pattern names it in full

_FIGURE = re.compile(r"[0-9]+(?:\.(?P<decimals>[0-9]+))?\Z")

_ENTRY = 2  # parts of the path of an entry, such as units/TDC001

_PROSE = frozenset(
    {"page", "pages", "more_pages", "title", "summary", "note", "source", "printed", "document", "chapter",
     "order", "confirmed", "unknown", "spelling", "witness"}
)  # fmt: skip
"""Keys of texts for people, of references to the document, of the words of a name, and of this check."""

_IN_CHAPTERS = (
    "formats/*/size", "framing/devices", "framing/prefix", "framing/terminator", "units/*/usb_prefix",
    "messages/*/id", "parameter_sets/*/ids/*", "messages/*/length", "parameter_sets/*/length",
    "*/header", "*/req", "*/param[12]/name", "*/fields/*/format", "setup_commands/*/byte",
    "setup_commands/*/keyboard", "commands/*/byte", "commands/*/keyboard", "commands/*/size",
)  # fmt: skip
"""Paths of facts that other chapters of the transcription compare at every entry."""


def compare_statements(
    comparison: Comparison,
    facts: Facts,
    files: Mapping[str, list[Document]],
    diagnostics: Diagnostics,
) -> None:
    """Compare the statements of the document with the registry, as places ``statements/PATH``.

    :param facts: the registry: the facts of an overlay and of its protocol.
    :param files: the files of the protocol, or of the overlay. Only their scales have a ``printed`` text from
        this document.
    """
    ours = {
        path
        for kind in (*OF_REGISTRY, "additions")
        for d in files.get(kind, [])
        for path in _texts(d.data)
    }
    for document in files.get("printed", []):
        comparison.document = document
        for index, entry in enumerate(document.data.get(CHAPTER, ())):
            for pattern, value in entry["states"].items():
                path = (CHAPTER, index, "states", pattern)
                for at, key, holder in facts.at(pattern, document, path, diagnostics):
                    place = "/".join(filter(None, (CHAPTER, at, key)))
                    comparison.same(place, path, *facts.sides(value, holder.get(key, NOTHING)))
                    if at in ours and "printed" in holder and key != "printed":
                        words = entry["words"], holder["printed"]
                        comparison.same(f"{place}/words", path, *words)


def check_decisions(
    facts: Facts, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Check that the registry has the values that the decisions state."""
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


def check_witnesses(facts: Facts, tables: Iterable[str], diagnostics: Diagnostics) -> None:
    """Check that every fact is in a statement, in a decision, or in another chapter.

    :param tables: patterns of the facts whose table in another chapter was compared.
    """
    patterns, compared = list(_IN_CHAPTERS), set[str]()
    for table in tables:
        if _is_pattern(table):
            patterns.append(table)
        else:
            compared.add(table)
    in_chapters = re.compile("|".join(map(translate, patterns)))
    for document in facts.documents:
        for path in facts_of(document.data):
            fact = "/".join(map(str, path))
            known = fact in facts.stated or fact in compared
            if not known and not in_chapters.match(fact):
                diagnostics.add(document.place(*path), "SW043", f"{fact} has no second witness")


def _texts(node: Json, path: str = "") -> Iterator[str]:
    """Yield the path of each mapping with a ``printed`` text."""
    if "printed" in node:
        yield path
    for key, inner in node.items():
        if isinstance(inner, dict):
            yield from _texts(inner, f"{path}/{key}".lstrip("/"))


def facts_of(node: Json, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the path of each fact: of values, of lists, and of entries that contain only prose."""
    for key, inner in node.items():
        at = (*path, key)
        if key in _PROSE:
            continue
        found = [*facts_of(inner, at)] if isinstance(inner, dict) else []
        yield from found or [at]


class Facts:
    """The files of a registry, where facts are found by their paths.

    ``stated`` contains the paths that :meth:`at` has found, and those of the entries of a mapping, because
    a mapping is compared by its keys: its entries may be texts.
    """

    def __init__(self, protocol: Protocol, files: Mapping[str, list[Document]]) -> None:
        self.messages = protocol.messages
        self.documents = [document for kind in OF_REGISTRY for document in files.get(kind, [])]
        self.stated: set[str] = set()

    def at(
        self,
        pattern: str,
        document: Document,
        path: tuple[str | int, ...],
        diagnostics: Diagnostics,
    ) -> Iterator[tuple[str, str, Json]]:
        """Yield path, key and holder of each fact that a pattern names; the holder may lack the key.

        In each part of a pattern, ``*`` and ``?`` match as in file names, and ``|`` separates alternatives.
        An alternative that matches nothing is an error at this path of the document, and so is an entry
        named in full without the next part. The last part is a key, which each holder must have. A pattern
        of one part names a key at the top of a file.
        """
        *parts, last = pattern.split("/")
        roots = [document.data for document in self.documents]
        roots = roots if parts else [root for root in roots if last in root] or roots[:1]
        found: list[Found] = [("", root, False) for root in roots]
        for depth, part in enumerate(parts):
            below, unmatched = _below(found, part, in_an_entry=depth >= _ENTRY)
            for wanted in unmatched:
                what = f"{pattern}: the registry has nothing that {wanted} names"
                diagnostics.add(document.place(*path), "SW049", what)
            if unmatched:
                return
            found = below
        for at, holder, _ in found:
            for key in last.split("|"):
                self._state(f"{at}/{key}".lstrip("/"), holder.get(key))
                yield at, key, holder

    def _state(self, path: str, value: Any) -> None:
        self.stated.add(path)
        if isinstance(value, dict):
            texts = [key for key, inner in value.items() if isinstance(inner, str | dict)]
            self.stated.update(f"{path}/{key}" for key in texts)

    def sides(self, stated: Any, encoded: Any) -> tuple[str, str]:
        """Return a stated and an encoded value as texts, which are equal if the values are.

        Numbers have several spellings, and a quoted one may be rounded. Lists may have any order, and only
        their differences are shown. A mapping is compared by its keys, and facts about firmware by their
        versions.
        """
        if _rounded(stated, encoded):
            return str(stated), str(stated)
        if isinstance(stated, dict):
            stated = self._on_pages(stated)
        if isinstance(encoded, dict):
            encoded = [*encoded]
        if isinstance(stated, list) and isinstance(encoded, list):
            encoded = [fact["version"] if isinstance(fact, dict) else fact for fact in encoded]
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


def _is_pattern(text: str) -> bool:
    """Whether a text is a pattern, not a name."""
    return any(char in text for char in "*?[")


def _below(
    found: Iterable[Found], part: str, *, in_an_entry: bool
) -> tuple[list[Found], list[str]]:
    """Return the mappings one level below others whose names match, and what the registry lacks.

    :param in_an_entry: whether the others belong to one entry; the entries of a section are in several files.
    """
    below: list[Found] = []
    lacking = []
    for wanted in part.split("|"):
        named = not _is_pattern(wanted)
        matched = [
            (f"{at}/{key}".lstrip("/"), holder[key], named and (exact or not in_an_entry))
            for at, holder, exact in found
            for key in ([wanted] if named and wanted in holder else () if named else holder)
            if isinstance(holder[key], dict) and (named or fnmatchcase(key, wanted))
        ]
        without = [
            f"{at}/{wanted}"
            for at, holder, exact in found
            if in_an_entry and exact and named and not isinstance(holder.get(wanted), dict)
        ]
        lacking += without or ([] if matched else [wanted])
        below += matched
    return below, lacking


def _rounded(stated: Any, encoded: Any) -> bool:
    """Whether an exact factor, rounded to the digits of a printed figure, is that figure."""
    figure = _FIGURE.match(stated) if isinstance(stated, str) else None
    if figure is None or not RATIONAL.match(str(encoded)):
        return False
    half = Fraction(1, 2 * 10 ** len(figure["decimals"] or ""))
    return abs(Fraction(str(encoded)) - Fraction(stated)) <= half


def _listed(members: Counter[str]) -> str:
    return ", ".join(sorted(members.elements())) or NOTHING


def _text(value: Any) -> str:
    if isinstance(value, list):
        return _listed(Counter(map(str, value)))
    return str(value).lower() if isinstance(value, bool) else str(value)

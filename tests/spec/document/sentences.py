"""The sentences of a document by page, position and digest, as rules and ``not_rules.yaml`` name them.

The repository has no sentences of the documents, only these references: the page, the position of the
sentence among those of the page (headings count), and the beginning of the SHA-256 of its letters without
blanks and markup. A line whose page is uncertain counts on each of its possible pages.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from . import extract, flow
from .text import Document

CONTENTS = {"thorlabs_apt": 5, "asi_ms2000": 0}  # pages of contents before the text begins
DIGITS = 12
Reference = dict[str, Any]  # page, number, digest


def digest(text: str) -> str:
    """Return the digest of a sentence; blanks and markup do not matter."""
    return hashlib.sha256(flow.squeeze(text).encode()).hexdigest()[:DIGITS]


def read(protocol: str, document: Document) -> Sentences:
    """Return the sentences of a protocol's document."""
    if protocol == "thorlabs_apt":  # its pages are narrowed by its headings
        return Sentences(flow.Flow(extract.read(document).document, paged=True))
    return Sentences(flow.Flow(document, paged=False))


@dataclass(frozen=True)
class Numbered:
    """A sentence and its position on one page."""

    page: int
    number: int
    digest: str
    sentence: flow.Sentence

    def __str__(self) -> str:
        where = f"{{page: {self.page}, number: {self.number}, digest: {self.digest!r}}}"
        return f"{where} {self.sentence.text!r}"


class Sentences:
    """All sentences and headings of a document."""

    def __init__(self, read: flow.Flow) -> None:
        self.all = list(read.sentences())
        self._by_page: dict[int, list[Numbered]] = defaultdict(list)
        for sentence in self.all:
            for page in range(sentence.pages[0], sentence.pages[1] + 1):
                on_page = self._by_page[page]
                on_page.append(Numbered(page, len(on_page) + 1, digest(sentence.text), sentence))

    def on(self, page: int) -> list[Numbered]:
        """Return the sentences that are possibly on a page, in order."""
        return self._by_page.get(page, [])

    def normative(self, protocol: str) -> Iterator[tuple[str, flow.Sentence]]:
        """Yield every sentence about required behaviour, after its first normative word."""
        for sentence in self.all:
            match = flow.NORMATIVE.search(sentence.text)
            if match and not sentence.heading and sentence.pages[0] > CONTENTS[protocol]:
                yield match.group(), sentence

    def claim(self, references: Iterable[Reference]) -> tuple[set[flow.Sentence], list[str]]:
        """Return the sentences that references name, and what is wrong with the others.

        A sentence that a page has several times is claimed by its first position.
        """
        claimed: set[flow.Sentence] = set()
        problems = []
        for reference in references:
            same = [one for one in self.on(reference["page"]) if one.digest == reference["digest"]]
            claimed.update(one.sentence for one in same)
            if not same or same[0].number != reference["number"]:
                problems.append(self._explain(reference, same))
        return claimed, problems

    def _explain(self, reference: Reference, same: list[Numbered]) -> str:
        page, number, wanted = reference["page"], reference["number"], reference["digest"]
        asked = f"page {page}, sentence {number}, digest {wanted}"
        if same:
            return f"{asked}: the sentence is at another position: {same[0]}"
        elsewhere = [one for on_page in self._by_page.values() for one in on_page]
        moved = next((one for one in elsewhere if one.digest == wanted), None)
        if moved:
            return f"{asked}: the sentence is on another page: {moved}"
        there = next((one for one in self.on(page) if one.number == number), None)
        found = f"the sentence there is {there}" if there else f"page {page} has no such sentence"
        return f"{asked}: no sentence of the document has this digest; {found}"

    def reference(self, sentence: flow.Sentence) -> Numbered:
        """Return a sentence with its position on the first page on which it can be."""
        return next(one for one in self.on(sentence.pages[0]) if one.sentence == sentence)

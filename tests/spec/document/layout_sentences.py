"""The sentences of Issue 37, whose text keeps the layout of the pages.

Descriptions in tables are read from the widest cell of each line, so that a sentence of a description is
whole again. A reference has the page, the position among the sentences of the page, and the digest.
"""

from __future__ import annotations

import re
from pathlib import Path

from . import flow
from .sentences import digest

EDGE = re.compile(r"\s*Thorlabs Motion Controllers .* Issue 37|\s*Page \d+ of \d+")
Numbered = tuple[int, int, str, str]  # page, number, digest, text


class LayoutSentences:
    """The sentences of each page."""

    def __init__(self, path: Path) -> None:
        self._pages = path.read_text(encoding="utf-8").split("\f")

    def on(self, page: int) -> list[Numbered]:
        """Return the sentences on a page, in order."""
        found: list[str] = []
        words: list[str] = []
        for line in [*self._pages[page - 1].split("\n"), ""]:
            cells = [cell for cell in re.split(r"\s{2,}", line.strip()) if cell]
            if cells and not EDGE.fullmatch(line):
                words.append(max(cells, key=len))
            elif words:
                found += flow.SENTENCE_END.split(flow.plain(" ".join(words)))
                words = []
        return [(page, at, digest(text), text) for at, text in enumerate(found, 1)]

    def problems(self, references: list[dict[str, int | str]]) -> list[str]:
        """Return the references to sentences that are not at their places."""
        wrong = []
        for one in references:
            there = {(number, short) for _, number, short, _ in self.on(int(one["page"]))}
            if (one["number"], one["digest"]) not in there:
                wrong.append(f"page {one['page']} has no sentence {one['number']} {one['digest']}")
        return wrong

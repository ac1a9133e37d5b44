"""The text of a vendor's document: its path, its lines, and the page of each line."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

from checkout import ROOT

NAMES = {"thorlabs_apt": "000_10158ebefc6a9f15.txt", "asi_ms2000": "001_d6e265560c7eb5e3.txt"}
OTHERS = {"thorlabs_apt_issue_37": "thorlabs_apt_issue_37.txt"}  # a later issue, only searched
VARIABLE = "STAGEWIRE_DOCUMENTS"
WITHOUT = "none"  # for a public CI, which cannot have the documents

FOOTER = re.compile(r"^\**Thorlabs Confidential\**(?: Page (?P<page>\d+) of \d+)?(?P<rest>.*)$")


def find(name: str) -> Path | None:
    """Return the path of the text of a document, or None if it is not available."""
    named = os.environ.get(VARIABLE)
    if named == WITHOUT:
        return None
    folder = Path(named) if named else ROOT.parent / "shared" / "documents"
    path = folder / {**NAMES, **OTHERS}[name]
    return path if path.is_file() else None


@dataclass(repr=False)
class Document:
    """Lines (numbered from one), footers, and the range of possible pages of each line."""

    lines: list[str]
    footers: dict[int, int | None] = field(default_factory=dict)
    _pages: dict[int, tuple[int, int]] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Document:
        document = cls(path.read_text(encoding="utf-8").split("\n"))
        document._split_footers()
        document._lay_pages()
        return document

    def __getitem__(self, number: int) -> str:
        """Return a line without its footer (a footer runs into the next line in two places)."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""

    def numbers(self) -> range:
        return range(1, len(self.lines) + 1)

    def is_footer(self, number: int) -> bool:
        return number in self.footers

    def pages(self, number: int) -> tuple[int, int]:
        """Return the first and the last possible page of a line."""
        return self._pages[number]

    def sure(self, number: int) -> bool:
        low, high = self._pages[number]
        return low == high

    def _split_footers(self) -> None:
        for number in self.numbers():
            match = FOOTER.match(self[number])
            if match:
                page = match["page"]
                self.footers[number] = int(page) if page else None
                self.lines[number - 1] = match["rest"].strip()

    def footer_pages(self) -> dict[int, tuple[int, int]]:
        """Return the first and the last possible page of each footer."""
        order = sorted(self.footers)
        found: dict[int, tuple[int, int]] = {}
        before = 0
        for index, line in enumerate(order):
            page = self.footers[line]
            if page is not None:
                found[line] = (page, page)
            else:
                steps = 0
                after = None
                for later in order[index + 1 :]:
                    steps += 1
                    after = self.footers[later]
                    if after is not None:
                        break
                first = before + 1
                found[line] = (first, first if after is None else after - steps)
            before = found[line][0]
        return found

    def _lay_pages(self) -> None:
        ends = self.footer_pages()
        low = 1
        start = 1
        for line in sorted(ends):
            for number in range(start, line + 1):
                self._pages[number] = (low, ends[line][1])
            if self[line]:  # text after the footer is on the next page
                self._pages[line] = (ends[line][1] + 1, ends[line][1] + 1)
            start, low = line + 1, ends[line][0] + 1
        for number in range(start, len(self.lines) + 1):
            self._pages[number] = (low, low)

    def stretches(self) -> list[tuple[int, int]]:
        """Return the first and last line of every stretch with more than one possible page."""
        found: list[tuple[int, int]] = []
        for number in self.numbers():
            low, high = self._pages[number]
            if low == high or self.is_footer(number):
                continue
            if found and self._pages[number - 1] == (low, high):
                found[-1] = (found[-1][0], number)
            else:
                found.append((number, number))
        return found

    def anchor(self, number: int, page: int) -> None:
        """Narrow a stretch: the line and its successors are on the page or later, the others not later."""
        low, high = self._pages[number]
        if not low <= page <= high or low == high:
            return
        stretch = (low, high)
        step = number
        while self._pages.get(step) == stretch:
            self._pages[step] = (page, high)
            step += 1
        step = number - 1
        while self._pages.get(step) == stretch:
            self._pages[step] = (low, page)
            step -= 1

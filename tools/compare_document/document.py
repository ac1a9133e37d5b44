"""The lines of the text of Issue 37, and the headings, tables, values, lists and examples in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

EDGE: Final = re.compile(r"\s*Thorlabs Motion Controllers .* Issue 37|\s*Page \d+ of \d+")
MESSAGES: Final = range(45, 413)
"""Pages with the chapters of messages."""

FILLER: Final = re.compile(r"reserved|not used|unused|for future use", re.IGNORECASE)
"""Names that fields next to each other may share."""


@dataclass(frozen=True)
class Row:
    """A row of a list or of the index: a name, its id and its page."""

    line: int
    name: str
    id: str
    page: str


@dataclass(frozen=True)
class Heading:
    """A message, and the page and the line of its heading.

    ``part`` is the line of the heading of a sub-message below it, or 0.
    """

    line: int
    page: int
    name: str
    id: str
    part: int = 0

    @property
    def place(self) -> tuple[int, int]:
        """Return the lines of the heading and of the sub-message."""
        return self.line, self.part


@dataclass(frozen=True)
class SubMessage:
    """A line with a sub-message and its number: its heading, or a row of a list."""

    line: int
    page: int
    title: str
    id: str


@dataclass
class Cell:
    """Words between two columns of the text."""

    left: int
    right: int
    text: str

    @property
    def centre(self) -> float:
        """Return the column of the middle."""
        return (self.left + self.right) / 2

    @property
    def name(self) -> str:
        """Return the words without the arrows around them."""
        return re.sub(r"[<>]|--+", "", self.text).strip("- ")


@dataclass
class ByteTable:
    """The numbers of the bytes, and the cells below them."""

    line: int
    page: int
    group: list[Heading]
    part: str
    structure: int | None
    packet: int | None
    numbers: list[int] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)  # of the rows of numbers
    header: list[str] = field(default_factory=lambda: [""] * 6)
    places: list[float] = field(default_factory=list)  # columns of the third and the fourth cell
    rows: list[tuple[list[Cell], list[Cell]]] = field(default_factory=list)  # numbers, data
    is_open: bool = False  # the numbers end with "etc."

    @property
    def message(self) -> Heading:
        """Return the heading, of those above the table, to which it belongs."""
        verb = {"REQUEST": "REQ"}.get(self.part, self.part)
        fitting = [heading for heading in self.group if verb in heading.name.split("_")]
        return (fitting or self.group)[0]

    def columns(self) -> list[str]:
        """Return the names of the data; a name that continues in the next row once."""
        found: list[str] = []
        for _, cells in self.rows:
            names = [cell.name for cell in cells]
            repeated = found and names and names[0] == found[-1] and not FILLER.match(names[0])
            found += names[1:] if repeated else names
        return found


@dataclass
class FieldTable:
    """The names, descriptions and formats of fields."""

    line: int
    page: int
    group: list[Heading]
    rows: list[FieldRow] = field(default_factory=list)


@dataclass
class FieldRow:
    """A field with the line on which it begins."""

    line: int
    name: str
    format: str
    description: str


@dataclass(frozen=True)
class Value:
    """A number, and the words before and after it: a row of an enumeration or of a table of bits."""

    line: int
    page: int
    value: str
    text: str


@dataclass(frozen=True)
class Example:
    """A printed frame; ``kind`` is TX, RX, or empty for bytes without a mark."""

    line: int
    page: int
    kind: str
    data: str


@dataclass(repr=False)
class Document:
    """The lines of the text, numbered from one, and everything that was read from them."""

    lines: list[str]
    pages: list[int] = field(default_factory=list)
    headings: list[Heading] = field(default_factory=list)
    sub_messages: list[SubMessage] = field(default_factory=list)
    tables: list[ByteTable] = field(default_factory=list)
    fields: list[FieldTable] = field(default_factory=list)
    lists: dict[int, tuple[str, list[Row]]] = field(default_factory=dict)
    index: list[Row] = field(default_factory=list)
    titles: list[tuple[int, str, str]] = field(default_factory=list)
    values: list[Value] = field(default_factory=list)
    ticks: dict[str, dict[tuple[str, str], bool]] = field(default_factory=dict)  # by unit, bit
    examples: list[Example] = field(default_factory=list)
    unread: list[tuple[int, str]] = field(default_factory=list)  # lines and kinds

    @classmethod
    def open(cls, path: Path) -> Document:
        """Read the lines: a form feed begins a page, whose first and last lines are dropped."""
        document = cls([])
        page = 1
        for line in path.read_text(encoding="utf-8").split("\n"):
            page += line.count("\f")
            edge = EDGE.fullmatch(line)
            document.lines.append("" if edge else line.replace("\f", "").rstrip())
            document.pages.append(page)
        return document

    def __getitem__(self, number: int) -> str:
        """Return a line, empty outside the document."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""

    def page(self, number: int) -> int:
        """Return the page of a line."""
        return self.pages[number - 1]

    def numbers(self, pages: range) -> Iterator[int]:
        """Yield the numbers of the lines on some pages."""
        for number, page in enumerate(self.pages, 1):
            if page in pages:
                yield number

    def chapters(self) -> Iterator[tuple[range, str]]:
        """Yield the pages and the title of each chapter of messages, as the index has them."""
        found = [(int(page), title) for _, title, page in self.titles if title.endswith("Messages")]
        ends = [page for page, _ in found[1:]] + [MESSAGES.stop]
        for (first, title), end in zip(found, ends, strict=True):
            yield range(first, end), title

    def passage(self, line: int, length: int = 4) -> str:
        """Return a line and the next ones with text as one text."""
        found: list[str] = []
        while len(found) < length and line <= len(self.lines):
            found += filter(None, [self[line].strip()])
            line += 1
        return " ".join(found)

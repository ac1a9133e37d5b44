"""The words and sentences of a vendor's document in reading order.

Tables with descriptions are read cell by cell, so that a sentence that fills several rows of a cell is a
sentence again. Blanks, markup and line ends are ignored, because the scan has too many of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from .text import Document

# Words of sentences about required or usual behaviour.
WORDS = (
    # duties, permissions and prohibitions
    "must|shall|should|may|can|always|never|only|cannot|required|requires|recommended|acceptable|allowed",
    "not (?:be )?(?:allowed|altered|changed|supported|used|applicable|required|relevant|implemented)",
    "do not|does not|no longer (?:any )?need|ignored|unused|applicable|apply|applies|applied|"
    "supports?|fixed|at least|until",
    # answers, messages and stored values
    "will|is sent|are sent|sends?|sent|returned|returns?|responds?|no (?:response|reply)|response is",
    "is output|are output|automatically|periodically|continuously|immediately|swapped|stored|saved",
    # values
    "in the range|range (?:is|\\d)|value range|accepts?|between \\d|maximum of|less than|greater than",
    "signed|unsigned|is set|are set|set to|default (?:value|setting|state)",
    # purposes of messages
    "used to (?:set|start|stop|request|load|save|limit|select)|stops?|disables?|enables?|resume|initiates",
    # habits
    "typically|usually|normally|in general|by default",
)
NORMATIVE = re.compile(rf"\b(?:{'|'.join(WORDS)})\b", re.IGNORECASE)
SENTENCE_END = re.compile(r"(?<=[.:;?!])\s+(?=[\"'(‘A-Z0-9•*-])")
MARKUP = re.compile(r"</?(?:b|u|a|sup|sub|td|type|softv|mo)\b[^>]*>|\\text|[*#$`{}\\]")
LETTERS = {"µ": "μ", "\u00a0": " ", "’": "'", "‘": "'", "“": '"', "”": '"'}
# A row of byte numbers in a byte table; a row of the contents or of a list of messages.
NUMBERS = re.compile(r"(?:^|\t)\W*\d+(?:[\t ]+\d+){3}")
LISTED = re.compile(r"MGMSG[A-Z0-9 _\t\\]+[:;]?[\t ]+0x")
# First cells of the rows that head a table, and whether its second column has descriptions.
HEADS = {"field": True, "Hex Value": False, "bit mask": False, "format": False, "Command": False}
FORMATS = {"", "word", "long", "short", "dword", "char", "char[8]", "char[64]", "byte[4]"}
UPPER_HEADING = re.compile(r"[A-Z][A-Z ]+[A-Z]|Command: [A-Z].*")


def plain(text: str) -> str:
    """Drop the markup and replace variants of the same character by one."""
    text = MARKUP.sub("", text.replace("\\mu", "μ"))
    return "".join(LETTERS.get(letter, letter) for letter in text)


def squeeze(text: str) -> str:
    return re.sub(r"\s+", "", plain(text))


@dataclass(frozen=True)
class Piece:
    """Some words of one line: the whole line, or its part in the current column."""

    line: int
    text: str
    ends: bool  # the sentence does not continue after it


@dataclass(frozen=True)
class Sentence:
    line: int
    pages: tuple[int, int]
    text: str
    span: tuple[int, int]  # within the squeezed flow
    heading: bool


def sections(document: Document) -> dict[int, tuple[int, int]]:
    """Return the section of each line, for a document divided by headings instead of footers."""
    found = {}
    section = 0
    for number in document.numbers():
        if number > 1 and UPPER_HEADING.fullmatch(document[number].strip()):
            section += 1
        found[number] = (section, section)
    return found


class Flow:
    """All words of a document without blanks, each with its line and its possible pages."""

    def __init__(self, document: Document, paged: bool) -> None:
        self.document = document
        places = sections(document)
        self._pages = document.pages if paged else places.__getitem__
        self.pieces = list(pieces(document))
        self.lines: list[int] = []
        letters: list[str] = []
        for piece in self.pieces:
            squeezed = squeeze(piece.text)
            letters.append(squeezed)
            self.lines.extend([piece.line] * len(squeezed))
        self.letters = "".join(letters)

    def pages(self, place: int) -> tuple[int, int]:
        """Return the first and the last possible page of a letter."""
        return self._pages(self.lines[place])

    def is_heading(self, place: int) -> bool:
        return self.document[self.lines[place]].startswith("#")

    def sentences(self) -> Iterator[Sentence]:
        """Yield the sentences and headings in order."""
        place = 0
        held: list[Piece] = []
        start = 0
        for piece in self.pieces:
            held.append(piece)
            place += len(squeeze(piece.text))
            if piece.ends:
                yield from self._split(held, start)
                held, start = [], place
        yield from self._split(held, start)

    def _split(self, held: list[Piece], start: int) -> Iterator[Sentence]:
        text = " ".join(plain(piece.text) for piece in held)
        for part in SENTENCE_END.split(text):
            end = start + len(squeeze(part))
            if end > start:
                yield Sentence(
                    self.lines[start],
                    self.pages(start),
                    " ".join(part.split()),
                    (start, end),
                    self.is_heading(start),
                )
            start = end


def pieces(document: Document) -> Iterator[Piece]:
    """Yield the words of a document, column by column in tables with descriptions."""
    code = False
    in_fields = False
    tables = byte_tables(document)
    for number in document.numbers():
        line = document[number]
        if line.startswith("```"):
            code = not code
            continue
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split("\t")]
        if len(cells) == 1 and not LISTED.match(line):
            in_fields = False
            yield Piece(number, line, _closes(document, number, code))
        elif number in tables or LISTED.match(line):
            in_fields = False
        elif cells[0] in HEADS:
            in_fields = HEADS[cells[0]]
        elif in_fields:
            last = None if cells[-1].lower() in FORMATS else len(cells)
            first = 0 if len(cells) == 2 else 1  # two cells: one description, torn
            yield Piece(number, " ".join(cells[first : last or -1]), False)
        else:
            behind = document[number + 1]
            yield Piece(number, " ".join(cells), "\t" not in behind or not behind.startswith("\t"))


def byte_tables(document: Document) -> set[int]:
    """Return the lines of byte tables, which contain no sentences: blocks with a row of numbers."""
    found: set[int] = set()
    block: list[int] = []
    for number in [*document.numbers(), 0]:
        if "\t" in document[number]:
            block.append(number)
            continue
        if any(NUMBERS.search(document[line]) for line in block):
            found.update(block)
        block = []
    return found


def _closes(document: Document, number: int, code: bool) -> bool:
    """Whether a sentence ends with this line: a blank line follows, then a capital or a mark."""
    if code:
        return False
    behind = number + 1
    while behind <= len(document.lines) and not document[behind].strip():
        behind += 1
    following = plain(document[behind]).strip()
    here = plain(document[number]).strip()
    if behind == number + 1:
        return False
    return here[-1:] in ".:;!?)" or not following[:1].islower()

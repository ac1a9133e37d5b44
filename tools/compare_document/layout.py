"""Read the text of Issue 37, which keeps the layout of the pages.

The program knows this layout but neither the protocol nor our transcription. It never guesses: what it cannot
read differs from the transcription, and a person resolves the difference on the image of the page.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from compare_document.document import MESSAGES, Document, Example, Row, Value
from compare_document.tables import HEADING, numbers_in, read_chapters, read_sub_message

LISTS: Final = range(2, 31)
INDEX: Final = range(413, 422)

ROW: Final = re.compile(
    r"(?P<name>MGMSG_ ?\w+(?:_ \w+)?[:;]?)\s+(?P<id>0[xX][0-9A-F]+\b)[ .]*(?P<page>\d+)"
)
BYTES: Final = re.compile(r"(?:[0-9A-F]{2}|…+)(?:[ ,.]+(?:[0-9A-F]{2}|…+))*+[ ,.]*(?=\s|$)")
DIRECTED: Final = re.compile(r"\b(?P<kind>TX|RX|Tx)(?=,? [0-9A-F]{2}[ ,]),? ?")
VALUE: Final = re.compile(r"-?0[xX][0-9A-Fa-f]+(?:\.[0-9A-Fa-f]{4})?")
VALUE_ROW: Final = re.compile(
    rf"\s*(?:(?P<label>[A-Za-z]\S*(?: \S+){{0,2}})(?<!;)\s+\(?)?(?P<value>{VALUE.pattern})(?:\):|(?![\w,)]))"
    r"\s*(?P<text>(?:[-–]|//)?\s*\w.*|$)"
)
PLAIN_VALUE_ROW: Final = re.compile(
    r"\s{4,}(?:\S+\s{2,})?(?:(?P<value>\d{1,2})\.?(?: [-–=]|(?=\s+[A-Z'‘])|, \d\d -)"
    r"|(?P<byte>byte\[\d+\]) =|[A-Z]+(?: [A-Z]+)*\s+(?P<last>\d)$|\w+(?: \S+)* = (?P<named>\d)$)"
)
TICK: Final = "✓"


def read(path: Path) -> Document:
    """Read the text of the document."""
    document = Document.open(path)
    read_lists(document)
    read_index(document)
    read_chapters(document)
    read_values(document)
    read_ticks(document)
    read_examples(document)
    return document


def read_lists(document: Document) -> None:
    """Read the lists of messages, each below its title."""
    rows: list[Row] = []
    for number in document.numbers(LISTS):
        text = document[number].strip()
        if "Messages Applicable" in text and not text.endswith("(Continued)"):
            document.lists[number] = (text, rows := [])
        elif one := read_sub_message(document, number):
            rows += [Row(part.line, part.title, part.id, "") for part in one]
        elif text.startswith("MGMSG"):
            row = ROW.fullmatch(text)
            if row:
                rows.append(Row(number, row["name"], row["id"], row["page"]))
            else:
                document.unread.append((number, "list"))


def read_index(document: Document) -> None:
    """Read the index at the end: messages, and titles."""
    for number in document.numbers(INDEX):
        text = document[number].strip()
        row = ROW.fullmatch(text)
        title = re.fullmatch(r"(?P<title>\S.*?)[ .]{2,}(?P<page>\d+)", text)
        if row:
            document.index.append(Row(number, row["name"], row["id"], row["page"]))
        elif title:
            document.titles.append((number, title["title"], title["page"]))
        elif text.startswith("MGMSG"):
            document.unread.append((number, "index"))


def read_values(document: Document) -> None:
    """Read the rows of enumerations and tables of bits: a number with 0x at the start, or after a name."""
    for number in document.numbers(MESSAGES):
        row = VALUE_ROW.fullmatch(document[number])
        if row and not HEADING.fullmatch(document[number].strip()):
            text = f"{row['label'] or ''} {row['text']}".strip()
            document.values.append(Value(number, document.page(number), row["value"], text))
        plain = PLAIN_VALUE_ROW.match(document[number])
        if plain:
            value = next(filter(None, plain.groups()))
            text = document[number].strip()
            document.values.append(Value(number, document.page(number), value, text))


def read_ticks(document: Document) -> None:
    """Read the table of status bits: the bits that are ticked in the column of each unit."""
    columns: list[tuple[float, str]] = []
    for number in document.numbers(MESSAGES):
        text = document[number]
        if document.page(number) != document.page(number - 1):
            columns = []
        if re.match(r"Bit\s+Definition\s+\S", text):
            names = list(re.finditer(r"\S+", text))[2:]
            columns = [((name.start() + name.end()) / 2, name.group()) for name in names]
            document.ticks = {name: {} for _, name in columns}
        row = re.match(rf"(?P<value>{VALUE.pattern})\s+(?P<name>\w+)", text)
        if not columns or not row:
            continue
        bit = (row["value"], row["name"])
        for ticks in document.ticks.values():
            ticks[bit] = False
        for tick in re.finditer(TICK, text):
            unit = min(columns, key=lambda column: abs(column[0] - tick.start()))[1]
            document.ticks[unit][bit] = True


def read_examples(document: Document) -> None:
    """Read lines of bytes: those marked TX or RX with the lines below, and those without a mark."""
    seen: set[int] = set()
    for number in range(1, len(document.lines) + 1):
        text = document[number]
        mark = DIRECTED.search(text)
        start = mark.end() if mark else len(text) - len(text.lstrip())
        data = BYTES.match(text, start)
        if number in seen or not data or numbers_in(text):
            if re.search(r"\b(?:TX|RX|Tx)[:,]?\s*[0-9A-F]{2}\b", text):
                document.unread.append((number, "example"))
            continue
        found = re.findall(r"[0-9A-F]{2}|…", re.sub("…+", "…", data.group()))
        if mark is None and len(found) < 6:
            continue
        following = number + 1
        while data and data.end() == len(text):
            text = document[following]
            data = BYTES.match(text, len(text) - len(text.lstrip(" ,")))
            if data and data.end() == len(text):
                found += re.findall(r"[0-9A-F]{2}|…", re.sub("…+", "…", data.group()))
                seen.add(following)
                following += 1
        kind = mark["kind"].upper() if mark else ""
        document.examples.append(Example(number, document.page(number), kind, " ".join(found)))

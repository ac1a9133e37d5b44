"""Read the chapters of messages: headings, byte tables and field tables."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from compare_document.document import (
    FILLER,
    MESSAGES,
    ByteTable,
    Cell,
    Document,
    FieldRow,
    FieldTable,
    Heading,
    SubMessage,
)

HEADING: Final = re.compile(r"MGMSG_ ?(?P<name>\w+?(?:_ \w+?)?)[:;]?\s{2,}(?P<id>0[xX][0-9A-F]{4})")
SUB_MESSAGE: Final = re.compile(
    r"(?P<title>\S.*?) \(sub-message ID ?= ?(?P<id>(?:[0-9A-F]+ [\[(])?(?:0x)?[0-9A-F]+[\])]?)\)?"
)
NAME_ALONE: Final = re.compile(r"MGMSG_ ?\w+[:;]?[\s\d]*")
LABEL: Final = re.compile(
    r"\s*(?P<label>SET|REQUEST|REQ|GET|HOMED|Short version|Long version)(?P<colon>:)?(?!\s*N/A)\s*"
    r"(?:\(.*\)\s*)?"
)
DIRECTION: Final = re.compile(r"\s*(?P<label>TX|RX) structure \(")
STRUCTURE: Final = re.compile(r"\bstructure \(?(?P<size>\d+) ?bytes\b", re.IGNORECASE)
PACKET: Final = re.compile(r"(?P<below>Followed|followed) by (?:a )?(?P<size>\d+)[- ]byte")
FORMAT: Final = re.compile(
    r"(?:\s{2,}|^)(?P<format>(?:unsigned )?(?:word|short|dword|long|char|byte|float|Unconstrained|\d words)"
    r"\b\]?(?:\[\w+\]?)?)$",
    re.IGNORECASE,
)
PHRASE: Final = re.compile(r"\S+(?: \S+)*")
LABELS: Final = re.compile(r"\s*|[\s,]*(?:header only|header|data)(?:\s+(?:header|data))?")
DESTINATION: Final = re.compile(r"d\|?|D0")
SOURCE: Final = re.compile(r"s|S1")


def read_chapters(document: Document) -> None:
    """Read headings, and byte tables and field tables with the headings above them."""
    group: list[Heading] = []
    context = Context()
    for number in document.numbers(MESSAGES):
        text = document[number].strip()
        heading = HEADING.fullmatch(text)
        part = SUB_MESSAGE.fullmatch(text)
        label, direction = LABEL.fullmatch(text), DIRECTION.match(text)
        if heading:
            if group and any(document[n] for n in range(group[-1].line + 1, number)):
                group = []
            page = document.page(number)
            name = heading["name"].replace(" ", "")
            group.append(Heading(number, page, name, heading["id"]))
            document.headings.append(group[-1])
            context = Context()
        elif part:
            document.sub_messages += read_sub_message(document, number)
            group = [replace(heading, part=number) for heading in group]
            context = Context()
        elif NAME_ALONE.fullmatch(text) and document[number] == text:
            document.unread.append((number, "heading"))
        elif label and (label["colon"] or text.isupper()):
            context = Context(label["label"])
        elif direction and not context.label.endswith("version"):
            context = Context(context.label or direction["label"])
        elif re.fullmatch(r"field\s+description\s+format?", text.casefold()):
            document.fields.append(read_fields(document, number, group))
        elif numbers_in(text)[:2] == [0, 1]:
            document.tables.append(read_table(document, number, group, context))
            context = Context()
        structure, packet = STRUCTURE.search(text), PACKET.search(text)
        context.structure = int(structure["size"]) if structure else context.structure
        if packet and packet.start() == 0 and packet["below"] == "Followed":
            document.tables[-1].packet = int(packet["size"])
        elif packet:
            context.packet = int(packet["size"])
    note_unread(document)


def read_sub_message(document: Document, number: int) -> list[SubMessage]:
    """Return the sub-message and its number on a line, if there is one."""
    found = SUB_MESSAGE.fullmatch(document[number].strip())
    if not found:
        return []
    id = found["id"] if re.search(r"[\[(]", found["id"]) else found["id"].rstrip("])")
    return [SubMessage(number, document.page(number), found["title"], id)]


@dataclass
class Context:
    """The label and the sizes above the next table."""

    label: str = ""
    structure: int | None = None
    packet: int | None = None


def note_unread(document: Document) -> None:
    """Note the rows "header" and "data" that belong to no table."""
    starts = {line for table in document.tables for line in table.lines}
    for number in document.numbers(MESSAGES):
        row = re.fullmatch(r"header(?: only)?(?:\s+data)?", document[number].strip().casefold())
        if row and not starts & {number - 1, number - 2, number - 3}:
            document.unread.append((number, "byte table"))


def numbers_in(text: str) -> list[int]:
    """Return the numbers of the bytes in a row that has only these, or nothing."""
    words = re.sub(r"\bto\b|Etc…", " ", text).split()
    if len(words) < 2 or not all(re.fullmatch(r"0|[1-9]\d?|[1-9]\d[1-9]\d", w) for w in words):
        return []
    return [int(number) for word in words for number in re.findall(r"\d{1,2}", word)]


def read_table(
    document: Document, number: int, group: list[Heading], context: Context
) -> ByteTable:
    """Read the rows of a byte table: numbers, the words "header" and "data", and the cells."""
    table = ByteTable(
        number, document.page(number), list(group), context.label, context.structure, context.packet
    )
    while True:
        columns = [
            Cell(word.start(), word.end(), word.group())
            for word in re.finditer(r"\d{1,2}", document[number])
        ]
        expected = table.numbers[-1] + 1 if table.numbers else 0
        if not numbers_in(document[number]) or int(columns[0].text) != expected:
            return table
        table.numbers += [int(column.text) for column in columns]
        table.is_open |= "Etc" in document[number]
        table.lines.append(number)
        number += 1
        while LABELS.fullmatch(document[number].casefold()):
            number += 1
        cells: list[Cell] = []
        while document[number] and not ends_table(document[number]):
            phrases = [
                Cell(p.start(), p.end(), p.group()) for p in PHRASE.finditer(document[number])
            ]
            if columns[0].text == "0":
                phrases = read_header(document[number], table, columns)
            if not cells:
                cells += phrases
                number += 1
                continue
            for phrase in phrases:  # the second line of a name
                cell = min(cells, key=lambda one: abs(one.centre - phrase.centre))
                cell.text = f"{cell.text} {phrase.text}"
            number += 1
        table.rows.append((columns, cells))
        while not document[number] and document.page(number) == table.page:
            number += 1


def ends_table(text: str) -> bool:
    """Whether a line is a sentence or the label of the next table, and not a row of cells."""
    label = LABEL.fullmatch(text)
    sentence = re.match(r"\S.*[a-z] [a-z]|Data Structure:", text)
    return bool(sentence or (label and label["colon"]))


def sizes_of(table: ByteTable) -> list[int]:
    """Return the number of bytes of each name in the data: a name is in the middle of its bytes."""
    found: list[int] = []
    last = ""
    for numbers, cells in table.rows:
        columns = [number.centre for number in numbers if int(number.text) > 5]
        sizes = fit(columns, [cell.centre for cell in cells])
        if cells and sizes and cells[0].name == last and not FILLER.match(last):
            found[-1] += sizes.pop(0)
        found += sizes
        last = cells[-1].name if cells else last
    return found


def fit(bytes_: list[float], names: list[float]) -> list[int]:
    """Divide bytes among names in order, each name as near as possible to the middle of its bytes."""
    best: dict[tuple[int, int], tuple[float, list[int]]] = {(0, 0): (0.0, [])}
    for name, centre in enumerate(names, 1):
        for end in range(name, len(bytes_) + 1):
            options = []
            for start in range(name - 1, end):
                if (start, name - 1) in best:
                    error, sizes = best[start, name - 1]
                    middle = (bytes_[start] + bytes_[end - 1]) / 2
                    options.append((error + (middle - centre) ** 2, [*sizes, end - start]))
            if options:
                best[end, name] = min(options)
    return best.get((len(bytes_), len(names)), (0.0, []))[1]


def read_header(text: str, table: ByteTable, columns: list[Cell]) -> list[Cell]:
    """Read the six cells of the header in a line, and return the cells of the data."""
    words = [Cell(w.start(), w.end(), w.group()) for w in re.finditer(r"\S+", text)]
    if any(table.header):  # the second line of a name
        edge = columns[6].left - 2 if len(columns) > 6 else len(text)
        for word in words:
            if word.centre < edge:
                offset = min((2, 3), key=lambda n: abs(table.places[n - 2] - word.centre))
                table.header[offset] = f"{table.header[offset]} {word.text}"
        return [
            Cell(p.start(), p.end(), p.group()) for p in PHRASE.finditer(text) if p.start() > edge
        ]
    ends = [
        place
        for place in range(3, len(words) - 1)
        if DESTINATION.fullmatch(words[place].text) and SOURCE.fullmatch(words[place + 1].text)
    ]
    middle = words[2 : ends[0]] if ends else []
    if not middle:
        return []
    gaps = [after.left - before.right for before, after in pairwise(middle)]
    cuts = [place for place, gap in enumerate(gaps, 1) if gap == max(gaps)] or [1]
    cut = min(cuts, key=lambda one: abs(middle[one].left - columns[3].left) if gaps else 0)
    parts = middle[:cut], middle[cut:]
    table.header = [
        *(word.text for word in words[:2]),
        *(" ".join(word.text for word in part) for part in parts),
        *(word.text for word in words[ends[0] : ends[0] + 2]),
    ]
    table.places = [(part[0].left + part[-1].right) / 2 if part else 0.0 for part in parts]
    left = words[ends[0] + 1].right
    return [Cell(p.start(), p.end(), p.group()) for p in PHRASE.finditer(text, left)]


def read_fields(document: Document, start: int, group: list[Heading]) -> FieldTable:
    """Read the rows of a field table; a format at the end of a line begins a row."""
    table = FieldTable(start, document.page(start), list(group))
    lines = list(field_lines(document, start))
    for number in lines:
        page = [n for n in lines if document.page(n) == document.page(number)]
        text = document[number]
        form = FORMAT.search(text)
        if form:
            text = text[: form.start()]
        column = description_column(document, page)
        while (
            0 < column < len(text) and text[column - 1] != " "
        ):  # the description begins to the left
            column -= 1
        name, description = text[:column].strip(), text[column:].strip()
        if "  " in name:
            name, description = (part.strip() for part in text.strip().split("  ", 1))
        if name and not form and re.match(r"\s{4}", text):  # only names begin near the margin
            name, description = "", text.strip()
        if form:
            table.rows.append(FieldRow(number, name, form["format"], description))
        elif FILLER.fullmatch(text.strip()) and table.rows:  # a row without description and format
            table.rows.append(FieldRow(number, text.strip(), "", ""))
        elif table.rows:
            row = table.rows[-1]
            tail = re.search(r"\s{4,}(\S{1,6}\]|array of long)$", document[number])
            if tail:  # the second line of a format
                row.format = f"{row.format} {tail[1]}"
                description = description.removesuffix(tail[1]).strip()
            row.name = f"{row.name} {name}".strip()
            row.description = f"{row.description} {description}".strip()
        elif name:
            document.unread.append((number, "fields"))
    return table


def field_lines(document: Document, start: int) -> Iterator[int]:
    """Yield the lines of a field table up to a line that begins at the margin."""
    for number in range(start + 1, len(document.lines) + 1):
        text = document[number]
        if re.match(r"\S", text) or HEADING.fullmatch(text) or numbers_in(text):
            return
        if re.match(r"\s*(field\s+description|(TX|RX) [0-9A-F]{2},)", text):
            return
        if text:
            yield number


def description_column(document: Document, lines: list[int]) -> int:
    """Return the column at which most descriptions begin."""
    starts: dict[int, int] = {}
    for number in lines:
        found = re.match(r"(?: \S+(?: \S+)*\s{2,}|\s{6,})(?=\S)", document[number])
        if found and not FORMAT.fullmatch(document[number][found.end() :]):
            starts[found.end()] = starts.get(found.end(), 0) + 1
    return max(starts, key=lambda column: (starts[column], -column)) if starts else 200

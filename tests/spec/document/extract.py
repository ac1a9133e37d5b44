"""Parsers for the parts of the vendor's document that are laid out regularly.

They depend on the layout (headings, tables, lists, examples) but not on the protocol, and they never read our
transcription. A place that a parser cannot read is noted, not guessed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

from .text import Document

ID = r"0x[0-9A-F]{2,4}H?"
NAME = re.compile(r"MGMSG(?:\\?[_ \t])+[A-Z]+(?:\\?[_ ](?!MGMSG)[A-Z]{2,}[0-9]*)*")
CONTENTS_ROW = re.compile(r"(?P<name>MGMSG[A-Z_ ]+:?) (?P<id>0x[0-9A-F]{4}(?=\d{3}$)|0x\S+)")
NAMES_AND_IDS = re.compile(rf"(MGMSG[A-Z_ ]+?):? ({ID})")
STRUCTURE = re.compile(r"(?:^|\s)[Ss]tructure \((\d+) bytes\)")
PACKET = re.compile(r"([Ff])ollowed by (?:a )?(\d+)[- ]byte (?:\(0x[0-9A-F]+\) )?data packet")
LABEL = re.compile(r"(SET|REQUEST|REQ|GET|HOMED|Short version|Long version):(?!\s*N/A)")
DIRECTION = re.compile(r"(TX|RX) structure \(")
EXAMPLE_LABEL = re.compile(r"\b([A-Z]\w*(?: [A-Z]\w*){0,3}):")


@dataclass(frozen=True, order=True)
class Place:
    """A place that cannot be read."""

    line: int
    what: str


@dataclass(frozen=True)
class Row:
    """A row of the contents, of a cross-reference list or of an overview: a name and its id."""

    line: int
    name: str
    id: str
    page: str
    run_together: bool = False


@dataclass(frozen=True)
class Heading:
    line: int
    names: tuple[str, ...]
    ids: tuple[str, ...]
    lines: tuple[int, ...]

    def __add__(self, other: Heading) -> Heading:
        return Heading(
            self.line, self.names + other.names, self.ids + other.ids, self.lines + other.lines
        )


@dataclass
class ByteTable:
    line: int
    message: str
    part: str
    structure: int | None
    packet: int | None
    last_offset: int | None = None
    header: list[str | None] = field(default_factory=list)
    columns: list[str | None] = field(default_factory=list)  # None: a row that cannot be read


@dataclass(frozen=True)
class Example:
    line: int
    kind: str  # tx, rx or lost
    data: str  # hex pairs; empty for a lost one


@dataclass
class FieldTable:
    line: int
    rows: list[tuple[str, str] | None]  # None: a row that cannot be read

    def names(self) -> list[str]:
        return [row[0] for row in self.rows if row is not None]


@dataclass(repr=False)
class Reading:
    """Everything that was read."""

    document: Document
    contents: list[Row] = field(default_factory=list)
    titles: list[tuple[int, str, str]] = field(default_factory=list)
    overview: list[Row] = field(default_factory=list)
    mentions: list[tuple[int, str]] = field(default_factory=list)
    headings: list[Heading] = field(default_factory=list)
    tables: list[ByteTable] = field(default_factory=list)
    fields: list[FieldTable] = field(default_factory=list)
    lists: dict[str, tuple[int, list[Row]]] = field(default_factory=dict)
    examples: list[Example] = field(default_factory=list)
    unreadable: set[Place] = field(default_factory=set)
    phrases: list[str] = field(default_factory=list)

    def cannot_read(self, line: int, what: str) -> None:
        self.unreadable.add(Place(line, what))


def plain(text: str) -> str:
    """Drop the markup."""
    return re.sub(r"</?(?:b|u|a|sup)\b[^>]*>", "", text.replace("\\", "")).strip("#* \t")


def squash(text: str) -> str:
    """Keep only letters and digits, because blanks within torn words are unreliable."""
    return re.sub(r"[^a-z0-9]", "", text.casefold())


def pairs(text: str) -> list[tuple[str, str]]:
    """Return every name with its id in a row of the contents that has several."""
    return NAMES_AND_IDS.findall(text)


def short(name: str) -> str:
    """Return the name as in a heading of the witness: without MGMSG, and with underscores only."""
    return re.sub(r"[ _]+", "_", plain(name).rstrip(":;")).removeprefix("MGMSG_")


def read(document: Document) -> Reading:
    reading = Reading(document)
    read_contents(reading)
    read_headings(reading)
    read_lists(reading)
    read_overview(reading)
    read_mentions(reading)
    read_pages(reading)
    read_fields(reading)
    read_tables(reading)
    read_examples(reading)
    return reading


# --- contents, overview, lists -----------------------------------------------------------------


def read_contents(reading: Reading) -> None:
    document = reading.document
    start = next(n for n in document.numbers() if plain(document[n]) == "Contents")
    end = next(n for n in document.numbers() if n > start and document.is_footer(n))
    for number in range(start + 1, end):
        text, _, page = document[number].partition("\t")
        if not text:
            continue
        page = re.sub(r"^[. ]+", "", page.strip())
        if not text.startswith("MGMSG"):
            reading.titles.append((number, text, page))
            continue
        match = CONTENTS_ROW.match(text)
        rest = text[match.end() :].strip() if match else ""
        if not match or " . " in page or "MGMSG" in rest:
            reading.cannot_read(number, "contents row")
            continue
        together = bool(rest) and text[match.end()].isdigit()
        reading.contents.append(Row(number, match["name"], match["id"], page or rest, together))


def read_overview(reading: Reading) -> None:
    """Read rows of the form name, id, words, which only the overview tables have."""
    document = reading.document
    for number in document.numbers():
        cells = document[number].split("\t")
        if (
            len(cells) == 3
            and cells[0].startswith("MGMSG")
            and re.fullmatch(ID, cells[1])
            and re.match(r"[A-Z]", cells[2])
        ):
            reading.overview.append(Row(number, cells[0], cells[1], ""))


def list_rows(reading: Reading) -> Iterator[tuple[int, str]]:
    """Yield the lines of the cross-reference lists, each with the title of its list."""
    document = reading.document
    title = ""
    for number in document.numbers():
        text = document[number]
        if text.startswith("#"):
            title = plain(text) if "Messages Applicable to" in text else ""
        elif title and "\t" in text:
            yield number, title


def read_lists(reading: Reading) -> None:
    document = reading.document
    row = re.compile(rf"(MGMSG[A-Z_ ]*[:;]?) ({ID})\s?([\d ]*)")
    for number in document.numbers():
        if document[number].startswith("#") and "Messages Applicable to" in document[number]:
            reading.lists[plain(document[number])] = (number, [])
    for number, title in list_rows(reading):
        cells = [cell for cell in reading.document[number].split("\t") if cell]
        if cells[0] in ("MGMSG", "MGMSG_"):  # the name is torn
            cells[:2] = [cells[0] + ("" if cells[0].endswith("_") else " ") + cells[1]]
        match = row.fullmatch(" ".join(cells))
        if match:
            reading.lists[title][1].append(Row(number, match[1], match[2], match[3]))
        else:
            reading.cannot_read(number, "list row")


# --- headings, mentions and pages --------------------------------------------------------------


def read_headings(reading: Reading) -> None:
    """Read lines with names only, and as many ids in the same line or the next ones."""
    document = reading.document
    pending: list[tuple[int, str]] = []
    for number in document.numbers():
        text = plain(document[number])
        if not text:
            continue
        rest = NAME.sub("", text)
        names = [(number, name.group()) for name in NAME.finditer(text)]
        ids = re.findall(rf"\b{ID}(?!\S)", rest)
        if "\t" in text or re.sub(rf"\b{ID}|[:\s]", "", rest) or not (names or ids):
            pending = []
            continue
        pending += names
        if ids and len(ids) == len(pending) and number > reading.contents[-1].line:
            heading = Heading(
                pending[0][0],
                tuple(short(name) for _, name in pending),
                tuple(ids),
                tuple(line for line, _ in pending),
            )
            if reading.headings and reading.headings[-1].lines[-1] == number - 1:
                heading = reading.headings.pop() + heading  # one heading in several lines
            reading.headings.append(heading)
        if ids:
            pending = []


def read_mentions(reading: Reading) -> None:
    """Read the names in the running text and in descriptions."""
    document = reading.document
    known = {line for heading in reading.headings for line in heading.lines}
    known |= {row.line for row in reading.overview} | {number for number, _ in list_rows(reading)}
    start = reading.contents[-1].line
    for number in document.numbers():
        if number > start and number not in known:
            reading.mentions += [
                (number, match.group()) for match in NAME.finditer(document[number])
            ]


def read_pages(reading: Reading) -> None:
    """Narrow the pages of lines without a footer by the pages of headings in contents and lists."""
    document = reading.document
    for line, number in document.footers.items():
        if number is None:
            reading.cannot_read(line, "footer")
    missing = document.stretches()
    printed: dict[str, set[int]] = {}
    rows = list(reading.contents) + [row for _, rows in reading.lists.values() for row in rows]
    for row in rows:
        if re.fullmatch(r"\d+", row.page):
            printed.setdefault(short(row.name), set()).add(int(row.page))
    for _, title, printed_page in reading.titles:
        if printed_page:
            printed.setdefault(title, set()).add(int(printed_page))
    anchors = [(h.line, name) for h in reading.headings for name in h.names]
    anchors += [(n, plain(document[n])) for n in document.numbers() if document[n].startswith("#")]
    for line, name in sorted(anchors):
        for page in printed.get(name, ()):
            document.anchor(line, page)
    for first, last in missing:
        open_ones = [n for n in range(first, last + 1) if document[n] and not document.sure(n)]
        if open_ones:
            reading.cannot_read(open_ones[0], "page")


def heading_of(reading: Reading, line: int) -> Heading | None:
    before = [heading for heading in reading.headings if heading.line <= line]
    return before[-1] if before else None


# --- field tables ------------------------------------------------------------------------------


def read_fields(reading: Reading) -> None:
    document = reading.document
    for number in document.numbers():
        if [cell for cell in document[number].split("\t") if cell] == [
            "field",
            "description",
            "format",
        ]:
            reading.fields.append(read_field_table(reading, number))


def field_lines(document: Document, start: int) -> Iterator[int]:
    """Yield the lines of a field table; it continues after a footer if a row follows immediately."""
    number = start + 1
    while True:
        while "\t" in document[number]:
            yield number
            number += 1
        step = number
        while step in document.numbers() and not document[step] and not document.is_footer(step):
            step += 1
        if not document.is_footer(step) or document[step]:
            return
        step += 1
        while step in document.numbers() and not document[step]:
            step += 1
        cells = document[step].split("\t")
        if len(cells) < 3 or sum(cell.isdigit() for cell in cells) > 2:
            return
        number = step


def read_field_table(reading: Reading, start: int) -> FieldTable:
    """Read names and formats; a name without a format completes the name in the row above."""
    rows: list[tuple[str, str] | None] = []
    for number in field_lines(reading.document, start):
        row = cells_of(reading.document[number])
        name, text, form = row[:3]
        if not name:
            continue
        last = rows[-1] if rows else None
        extra = form and not re.fullmatch(r"\w+(\[\w+\])?", form)  # an extra column
        if not extra and (form or (re.match("[A-Z]", text) and not name.startswith("("))):
            rows.append((name, form))
        elif last is not None:
            rows[-1] = (f"{last[0]} {name}", last[1])
        else:
            reading.cannot_read(number, "field row")
            rows.append(None)
    return FieldTable(start, rows)


# --- byte tables -------------------------------------------------------------------------------


def cells_of(text: str) -> list[str]:
    return [cell.strip() for cell in text.split("\t")]


def numbers_in(cells: list[str]) -> list[int]:
    return [int(word) for cell in cells for word in cell.split() if word.isdigit()]


def is_number_row(cells: list[str]) -> bool:
    """Whether a row has ascending numbers and hardly anything else."""
    found = numbers_in(cells)
    words = [word for cell in cells for word in cell.split()]
    counting = sum(after == before + 1 for before, after in pairwise(found))
    plain_numbers = not any(re.match(r"0\d|\d{3}", word) for word in words)
    if not plain_numbers or not counting:
        return False
    return len(found) == len(words) or (counting >= 2 and len(found) >= len(words) - 2)


def is_label_row(cells: list[str]) -> bool:
    """Whether a row is "header only" or "header ... data", even if torn."""
    return bool(re.match(r"he.{1,3}der", squash("".join(cells))))


def is_data_label(cells: list[str]) -> bool:
    """Whether a row is the label "data" above data cells, such as "Do ta", "rta" or "L Data"."""
    return bool(re.fullmatch(r"[ldatoirn1]{1,5}", squash("".join(cells))))


@dataclass
class Context:
    """The text printed above the next table."""

    label: str = ""
    direction: str = ""
    structure: int | None = None
    packet: int | None = None

    def clear(self, label: str = "") -> None:
        self.label, self.direction = label, ""
        self.structure = self.packet = None


def read_tables(reading: Reading) -> None:
    document = reading.document
    starts = {line for heading in reading.headings for line in heading.lines}
    context = Context()
    block: list[int] = []
    for number in document.numbers():
        text = document[number]
        if "\t" in text:
            block.append(number)
            continue
        if block:
            read_block(reading, block, context)
            block = []
        if number in starts:
            context.clear()
        elif text:
            read_statement(reading, plain(text), context)


def read_statement(reading: Reading, text: str, context: Context) -> None:
    label = LABEL.match(text)
    if label:
        context.clear(label[1])
    direction = DIRECTION.match(text)
    if direction:
        context.direction = direction[1]
    structure = STRUCTURE.search(" " + text)
    if structure:
        context.structure = int(structure[1])
    packet = PACKET.search(text)
    if packet and packet[1] == "F" and text.startswith("F"):
        reading.tables[-1].packet = int(packet[2])  # a statement under its table
    elif packet:
        context.packet = int(packet[2])


def message_for(heading: Heading | None, context: Context) -> str:
    if heading is None:
        return ""
    verb = {"REQUEST": "REQ"}.get(context.label, context.label)
    found = [name for name in heading.names if verb and verb in name.split("_")]
    return found[0] if found else heading.names[0]


def read_block(reading: Reading, block: list[int], context: Context) -> None:
    """Read a block of lines with cells: the parts of a byte table, or something else."""
    rows = [(number, cells_of(reading.document[number])) for number in block]
    for index, (number, cells) in enumerate(rows):
        after = rows[index + 1 :]
        ends = next((i for i, (_, later) in enumerate(after) if is_number_row(later)), len(after))
        if is_number_row(cells):
            first = numbers_in(cells)[0]
            if first < 6:  # also a first row that has lost its first numbers
                open_table(reading, number, context)
                read_first_part(reading, cells, after[1:ends])
            elif reading.tables:
                labelled = bool(after[:ends]) and is_data_label(after[0][1])
                read_data(reading, number, after[labelled:ends])
            reading.tables[-1].last_offset = numbers_in(cells)[-1]
        elif index == 0 and is_label_row(cells):
            open_table(reading, number, context)
            read_first_part(reading, [], after[:ends])


def open_table(reading: Reading, line: int, context: Context) -> None:
    heading = heading_of(reading, line)
    reading.tables.append(
        ByteTable(
            line,
            message_for(heading, context),
            context.label or context.direction,
            context.structure,
            context.packet,
        )
    )
    context.structure = context.packet = None


def read_first_part(
    reading: Reading, numbers: list[str], rows: list[tuple[int, list[str]]]
) -> None:
    table = reading.tables[-1]
    if not rows:
        return
    line, cells = rows[0]
    has_data = table.packet is not None
    below = [row for _, row in rows[1:] if any(re.search(r"\w", cell) for cell in row)]
    below = [] if has_data else below
    column = numbers.index("0") if "0" in numbers[:2] else None
    squeezed = any(len(cell.split()) in (3, 4, 5) for cell in cells[:6])
    if column is not None and numbers[column : column + 6] == list("012345") and not squeezed:
        table.header = header_by_column(cells, below, column)
        data = cells[column + 6 :]
        if has_data and not data[0]:  # the first data cell is empty
            data = []
    elif is_shared(numbers):
        table.header = header_by_share(numbers, cells)
        data = []
    else:
        table.header, data = header_by_words(cells, below)
    if "d" in table.header[:4]:  # cells are lost, and the others have moved left
        table.header = [None] * 6
    if None in table.header:
        reading.cannot_read(line, "header")
    if has_data:
        read_data(reading, line, [(line, data), *rows[1:]])


def header_by_column(cells: list[str], below: list[list[str]], column: int) -> list[str | None]:
    """Read the header of a table with one number above each column."""
    for cell in cells[: column + 6]:
        if len(cell.split()) == 6:  # all six are in one cell
            return list(cell.split())
    parts = [cells[column : column + 6]]
    for row in below:
        lower = row[column : column + 6]
        if lower[0]:  # the row is printed twice
            parts = [lower]
        else:
            parts.append(lower)
    header: list[str | None] = []
    for place in range(6):
        words = [part[place] for part in parts if place < len(part) and part[place]]
        header.append(" ".join(words) or None)
    stray = "".join(cells[:column])
    if stray.isascii() and stray.isalnum():  # a piece of the first cell is outside the table
        header[0] = None
    return header


def is_shared(numbers: list[str]) -> bool:
    """Whether cells of the number row contain several numbers, with none missing."""
    shared = any(len(cell.split()) > 1 for cell in numbers)
    return shared and numbers_in(numbers)[:6] == [0, 1, 2, 3, 4, 5]


def header_by_share(numbers: list[str], cells: list[str]) -> list[str | None]:
    """Read the header of a table with several numbers in one cell of the number row."""
    header: list[str | None] = []
    for numbered, cell in zip(numbers, cells, strict=False):
        count = len(numbered.split())
        words = cell.split(maxsplit=count - 1) if count else []
        header += words + [None] * (count - len(words))
    return header


def header_by_words(cells: list[str], below: list[list[str]]) -> tuple[list[str | None], list[str]]:
    """Read the header without a number row, word by word up to "d s"."""
    words = [(word, index) for index, cell in enumerate(cells) for word in cell.split()]
    words = [(word, index) for word, index in words if re.search(r"\w", word)]
    header: list[str | None] = []
    last = len(cells)
    for place, (word, index) in enumerate(words):
        if word == "Ident" and header and header[-1] == "Chan":
            header[-1] = "Chan Ident"
            continue
        header.append(word)
        if word.casefold() == "s" and words[place - 1][0] == "d":
            last = index
            break
    for row in below:
        lower = [cell for cell in row if cell]
        upper = [p for p, word in enumerate(header) if word and re.fullmatch("[A-Z][a-z]+", word)]
        if len(lower) == len(upper) == 1:
            header[upper[0]] = f"{header[upper[0]]} {lower[0]}"
    if len(header) != 6:
        header = [None] * 6
    return header, cells[last + 1 :]


# --- the data cells of byte tables -------------------------------------------------------------


def read_data(reading: Reading, line: int, rows: list[tuple[int, list[str]]]) -> None:
    """Read the names of one row of data cells; a name continued from the row above counts once."""
    table = reading.tables[-1]
    rows = [(n, row) for n, row in rows if any(re.search(r"[^\W_]{2}", cell) for cell in row)]
    if not rows:
        if not any(place.what == "data" and place.line == line for place in reading.unreadable):
            reading.cannot_read(line, "data")
        table.columns.append(None)
        return
    number, cells = rows[0]
    names = None if len(rows) > 1 else name_cells(reading, number, cells)
    if names is None:
        reading.cannot_read(number, "data")
        table.columns.append(None)
        return
    last = [name for name in table.columns if name is not None][-1:]
    if last and squash(last[0]) == squash(names[0]):
        names = names[1:]
    table.columns.extend(names)


def vocabulary(reading: Reading, line: int) -> tuple[dict[str, str], dict[str, str]]:
    """Return the names that the document prints intact, under the same heading and anywhere."""
    near: dict[str, str] = {}
    wide: dict[str, str] = {}
    here = heading_of(reading, line)
    for table in reading.fields:
        for name in table.names():
            if len(squash(name)) >= 8:
                wide.setdefault(squash(name), name)
            if heading_of(reading, table.line) == here:
                near.setdefault(squash(name), name)
    for name in printed_phrases(reading):
        wide.setdefault(squash(name), name)
    for number in reading.document.numbers():
        if "\t" not in reading.document[number] and heading_of(reading, number) == here:
            for match in EXAMPLE_LABEL.finditer(plain(reading.document[number])):
                near.setdefault(squash(match[1]), match[1])
    return near, wide


def byte_table_lines(document: Document) -> set[int]:
    """Return the lines of all blocks with a row of byte numbers or a header label."""
    found: set[int] = set()
    block: list[int] = []
    for number in document.numbers():
        if "\t" in document[number]:
            block.append(number)
            continue
        rows = [cells_of(document[line]) for line in block]
        if any(is_number_row(row) or is_label_row(row) for row in rows):
            found.update(block)
        block = []
    return found


def printed_phrases(reading: Reading) -> list[str]:
    """Return two or three successive capitalised words outside the byte tables."""
    if not reading.phrases:
        document = reading.document
        cells = byte_table_lines(document)
        for number in document.numbers():
            text = plain(document[number])
            if number not in cells:
                for size in (2, 3):
                    one = r"[A-Z][A-Za-z]+"
                    found = re.findall(rf"(?=\b({one}(?: {one}){{{size - 1}}})\b)", text)
                    reading.phrases += found
        for table in reading.fields:
            for name in table.names():
                reading.phrases += re.findall(r"(?=\b([A-Z]\w+ [A-Z]\w+)\b)", name)
    return reading.phrases


def name_cells(reading: Reading, line: int, cells: list[str]) -> list[str] | None:
    near, wide = vocabulary(reading, line)
    words = [(squash(word), i) for i, cell in enumerate(cells) for word in cell.split()]
    words = [(word, index) for word, index in words if word]
    found: list[str] = []
    place = 0
    while place < len(words):
        for end in range(min(len(words), place + 6), place, -1):
            name = whole(words[place:end], near) or whole(words[place:end], wide)
            name = name or torn(words[place:end], near)
            if name:
                found.append(name)
                place = end
                break
        else:
            if found and is_doubled_end(squash(found[-1]), words, place):
                place += 1
                continue
            return None
    return list(found)


def is_doubled_end(name: str, words: list[tuple[str, int]], place: int) -> bool:
    """Whether a word is the end of a name, repeated in a separate cell after a tear."""
    word, index = words[place]
    return index != words[place - 1][1] and len(word) >= 3 and name.endswith(word)


def whole(words: list[tuple[str, int]], names: dict[str, str]) -> str | None:
    return names.get("".join(word for word, _ in words))


def torn(words: list[tuple[str, int]], names: dict[str, str]) -> str | None:
    """Find the only name that fits these pieces if each tear may damage a letter on either side."""
    pieces: list[str] = []
    before = None
    for word, index in words:
        if index == before:
            pieces[-1] += word
        else:
            pieces.append(word)
        before = index
    if len(pieces) < 2:
        return None
    pattern, sure = tear_pattern(pieces)
    found = [name for key, name in names.items() if pattern.fullmatch(key) and 2 * sure >= len(key)]
    return found[0] if len(found) == 1 else None


def tear_pattern(pieces: list[str]) -> tuple[re.Pattern[str], int]:
    """Return a pattern for torn pieces, and the number of letters that must be present.

    At a tear, the last and the first letter may be misread, and one letter may be lost.
    """
    text, sure = "", 0
    for index, piece in enumerate(pieces):
        torn_before, torn_after = index > 0, index + 1 < len(pieces)
        head = piece[:1] if torn_before and len(piece) > 1 else ""
        tail = piece[len(head) :][-1:] if torn_after else ""
        middle = piece[len(head) : len(piece) - len(tail)]
        text += ".?" if torn_before else ""
        text += "".join(f"{letter}?" for letter in head) + middle
        text += "".join(f"{letter}?" for letter in tail)
        sure += len(middle)
    return re.compile(text), sure


# --- worked examples ---------------------------------------------------------------------------


def read_examples(reading: Reading) -> None:
    """Read the byte lines, and find the breakdowns ("Header: ..") whose byte line is lost."""
    document = reading.document
    sent = False
    for number in document.numbers():
        text = plain(document[number])
        match = re.match(r"(TX|RX)[, ]\s*(?=[0-9A-F]{2},)(.*)$", text)
        if match:
            sent = True
            pairs = re.findall(r"[^\s,.]+", match[2])
            if any(not re.fullmatch(r"[0-9A-F]{2}", pair) for pair in pairs) or ".." in text:
                reading.cannot_read(number, "bytes")
            reading.examples.append(Example(number, match[1].lower(), " ".join(pairs)))
        elif text.startswith("Example") or number in {h.line for h in reading.headings}:
            sent = False
        elif re.match(r"Header: [0-9A-FO]{2},", text) and not sent:
            reading.examples.append(Example(number, "lost", ""))

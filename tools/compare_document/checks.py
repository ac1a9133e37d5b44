"""Compare each kind of place: headings, tables, values, lists, conversion factors and examples."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Final

from compare_document.comparison import (
    NOTHING,
    Comparison,
    Data,
    Transcription,
    contains,
    plain,
    squash,
)
from compare_document.document import ByteTable, Document, Heading
from compare_document.tables import sizes_of

SIZES: Final = {"word": 2, "short": 2, "dword": 4, "long": 4, "float": 4, "char": 1}
FACTORS: Final = range(38, 42)
"""Pages with the conversion factors of Section 8."""

SPACE: Final = r"\s+"
PASSAGE: Final = 4
"""Lines after a value with its text."""

TABLES: Final = {
    "motor_controllers": (range(61, 62), r"[A-Z]{3}[\dx]{3}\s"),
    "usb_prefixes": (range(32, 34), r"\d\dx{6}"),
    "addresses": (range(36, 37), r"0x..\s|…"),
    "formats": (range(38, 39), r"(?:word|short|dword|long|char|char\[N\])\s"),
}
"""Sections of ``lists.yaml``, their pages and the start of their rows."""


def compare(document: Document, transcription: Transcription) -> Comparison:
    """Compare the document with its transcription."""
    comparison = Comparison(document, transcription)
    compare_headings(comparison)
    compare_sub_messages(comparison)
    compare_tables(comparison)
    compare_fields(comparison)
    compare_values(comparison)
    compare_lists(comparison)
    compare_figures(comparison)
    compare_factors(comparison)
    compare_words(comparison)
    compare_examples(comparison)
    for line, what in document.unread:
        if comparison.covers(line):
            comparison.check(line, what, "cannot be read", NOTHING)
    return comparison


def compare_headings(comparison: Comparison) -> None:
    """Compare names, ids and pages of headings."""
    comparison.check_all(
        "heading",
        {
            heading.line: (heading.name, heading.id, heading.page)
            for heading in comparison.document.headings
            if comparison.covers(heading.line)
        },
        {
            entry["heading"]["line"]: (
                printed_name(name, entry),
                entry["heading"]["id"],
                entry["heading"]["page"],
            )
            for name, entry in comparison.transcription.messages
        },
    )


def printed_name(name: str, entry: Data) -> str:
    """Return the name in the heading of a message, which sub-messages share."""
    return str(entry.get("sub_message", {}).get("of", name))


def place_of(entry: Data) -> tuple[int, int]:
    """Return the lines of the heading and of the sub-message."""
    return entry["heading"]["line"], entry.get("sub_message", {}).get("line", 0)


def compare_sub_messages(comparison: Comparison) -> None:
    """Compare the headings of sub-messages, their rows in lists, and the bytes in their field tables."""
    printed: dict[int, object] = {}
    document = comparison.document
    for _, entry in comparison.transcription.messages:
        part = entry.get("sub_message")
        if part:
            printed[part["line"]] = (part["title"], part["id"], part["page"])
            rows = part.get("listed", ())
            printed |= {line: (*row, document.page(line)) for line, *row in rows}
            for line, bytes_ in (part["bytes"],) if "bytes" in part else ():
                read = bytes_ if bytes_ in document[line] else document[line].strip()
                comparison.check(line, "bytes of a sub-message", read, bytes_)
    found: dict[int, object] = {
        part.line: (part.title, part.id, part.page)
        for part in document.sub_messages
        if comparison.covers(part.line)
    }
    comparison.check_all("sub-message", found, printed)


def compare_tables(comparison: Comparison) -> None:
    """Compare byte tables: their place and sizes, their numbers, the header, and the names of the data."""
    expected = {
        table["line"]: (printed_name(name, entry), table)
        for name, entry in comparison.transcription.messages
        for table in entry["tables"]
    }
    found = {
        table.line: table for table in comparison.document.tables if comparison.covers(table.line)
    }
    for line in sorted({*found, *expected}):
        if line not in expected or line not in found:
            read = found[line].message.name if line in found else NOTHING
            comparison.check(line, "byte table", read, expected.get(line, [NOTHING])[0])
            continue
        table, (name, printed) = found[line], expected[line]
        last = None if table.is_open else table.numbers[-1]
        comparison.check(
            line,
            "byte table",
            (table.message.name, table.page, table.part, table.structure, table.packet, last),
            (
                name,
                *(printed[key] for key in ("page", "part")),
                *(printed.get(key) for key in ("structure", "packet", "last_offset")),
            ),
        )
        comparison.check(line, "numbers", runs(table.numbers), [f"0 to {table.numbers[-1]}"])
        for cells in zip_longest(table.header, printed["header"]):
            comparison.check(line, "header cell", *cells)
        compare_data(comparison, table, printed.get("columns", []))


def runs(numbers: Sequence[int]) -> list[str]:
    """Return the runs of consecutive numbers."""
    starts = [0, *(n for n in range(1, len(numbers)) if numbers[n] != numbers[n - 1] + 1)]
    ends = [*starts[1:], len(numbers)]
    return [
        f"{numbers[start]} to {numbers[end - 1]}" for start, end in zip(starts, ends, strict=True)
    ]


def compare_data(comparison: Comparison, table: ByteTable, names: Sequence[str]) -> None:
    """Compare the names in the data of a byte table, and the bytes below which they are printed."""
    read = table.columns()
    if [squash(name) for name in read] == [squash(name) for name in names]:
        comparison.read["name of data"] += len(names)
        comparison.equal["name of data"] += len(names)
    else:
        comparison.check(table.line, "name of data", read, names)
    formats, sizes = formats_of(comparison, table.group), sizes_of(table)
    if names and len(formats) == len(names) and None not in formats:
        comparison.check(table.line, "sizes of data", sizes, formats)


def formats_of(comparison: Comparison, group: Sequence[Heading]) -> list[int | None]:
    """Return the sizes of the fields that are transcribed for a group of headings."""
    places = {heading.place for heading in group}
    rows = [
        row
        for _, entry in comparison.transcription.messages
        if place_of(entry) in places
        for row in entry.get("rows", [])
    ]
    return [size_of(form) for _, form in rows]


def size_of(form: str) -> int | None:
    """Return the bytes of a printed format."""
    array = re.fullmatch(r"(?:char|byte)\[(\d+)(?: bytes)?\]", form)
    return int(array[1]) if array else SIZES.get(form.casefold().rstrip("]"))


def compare_fields(comparison: Comparison) -> None:
    """Compare names and formats of field tables, group by group of headings."""
    read: dict[tuple[int, int], list[tuple[int, str, str]]] = {}
    groups: dict[tuple[int, int], tuple[int, int]] = {}
    for table in comparison.document.fields:
        first = table.group[0].place
        groups.update({heading.place: first for heading in table.group})
        if comparison.covers(table.line):
            rows = [(row.line, row.name, row.format) for row in table.rows]
            read.setdefault(first, []).extend(rows)
    printed: dict[tuple[int, int], list[list[str]]] = {}
    for _, entry in comparison.transcription.messages:
        place = place_of(entry)
        printed.setdefault(groups.get(place, place), []).extend(entry.get("rows", []))
    for place in sorted({*read, *printed}):
        last = max(place)
        for row, other in zip_longest(read.get(place, []), printed.get(place, [])):
            last, *cells = row or (last, NOTHING)
            if other and squash(cells[0]) == squash(other[0]):
                cells[0] = other[0]
            comparison.check(last, "field", cells, other or [NOTHING])


def compare_values(comparison: Comparison) -> None:
    """Compare the values of enumerations and the bits of flag tables with their texts."""
    document = comparison.document
    claimed: set[int] = set()
    for _, entry in comparison.transcription.messages:
        for values in entry.get("values", []):
            if values.get("table", "").split(" ")[0] in document.ticks:
                compare_ticks(comparison, values)
            else:
                claimed.update(compare_list(comparison, values))
    table = {bit[0] for ticks in document.ticks.values() for bit in ticks}
    for value in document.values:
        if comparison.covers(value.line) and value.line not in claimed and value.value not in table:
            comparison.check(value.line, "value", (value.value, value.text), NOTHING)


def compare_ticks(comparison: Comparison, values: Data) -> None:
    """Compare every cell in the column of a unit in the table of status bits."""
    unit = values["table"].split(" ")[0]
    ticked = {tuple(row) for row in values["rows"]}
    bits = comparison.document.ticks[unit]
    for bit in sorted(bits.keys() | ticked):
        read = f"{unit} has {bit[0]}" if bits.get(bit) else NOTHING
        printed = f"{unit} has {bit[0]}" if bit in ticked else NOTHING
        comparison.check(values["line"], "cell of the status bits", read, printed)


def compare_list(comparison: Comparison, values: Data) -> Iterator[int]:
    """Compare one list of values, and yield its lines."""
    place = (values["line"], 0)
    for row in values["rows"]:
        parts = re.split(r"…|[()]", " ".join(row[1:]))
        value = next(filter(None, row))  # a row of a table of bits may have no mask
        found = list(find_value(comparison.document, place, value))
        fitting = [(line, end) for line, end, text in found if contains(text, parts)]
        fitting = [one for one in fitting if one[0] < fitting[0][0] + PASSAGE]
        fitting.sort(key=lambda one: not begins(comparison.document[one[0]], value))
        place = fitting[0] if fitting else place
        read = tuple(row) if fitting else found[0][2] if found else NOTHING
        comparison.check(place[0], "value", read, tuple(row))
        yield place[0]


def begins(text: str, value: str) -> bool:
    """Whether a line is the row of a value, and not a sentence with it."""
    return re.match(rf"\s*(?:\S+(?: \S+)*\s{{2,}})?{re.escape(value)}(?!\w)", text) is not None


def find_value(
    document: Document, place: tuple[int, int], value: str
) -> Iterator[tuple[int, int, str]]:
    """Yield the places of a value from a line and a column on: its line, its end, and the text there."""
    before = (
        r"(?<![\w.])"
        if "x" in value.casefold()
        else r"(?:^\s*|\s{2}|[:=–-]\s|\b(?:and|be|or|to|B)\s[‘']?)"
    )
    pattern = re.compile(rf"{before}{re.escape(value.removeprefix('to '))}(?!\w)", re.ASCII)
    for number in range(place[0], len(document.lines)):
        if document.page(number) > document.page(place[0]) + 1:
            return
        for found in pattern.finditer(document[number]):
            if number > place[0] or found.end() > place[1]:
                yield number, found.end(), document.passage(number, PASSAGE)


def compare_lists(comparison: Comparison) -> None:
    """Compare the lists of messages of the units, and the index."""
    document, contents = comparison.document, comparison.transcription.contents
    for entry in comparison.transcription.lists["lists"].values():
        title, rows = document.lists.get(entry["line"], (NOTHING, []))
        comparison.check(entry["line"], "title of a list", title, entry["title"])
        comparison.check_all(
            "row of a list",
            {row.line: (row.name, row.id, row.page) for row in rows},
            {row["line"]: (row["name"], row["id"], row.get("page", "")) for row in entry["rows"]},
        )
    last = contents["rows"][-1]["line"]
    comparison.check_all(
        "row of the index",
        {row.line: (row.name, row.id, row.page) for row in document.index if row.line <= last},
        {row["line"]: (row["name"], row["id"], row["page"]) for row in contents["rows"]},
    )
    comparison.check_all(
        "title of the index",
        {line: (title, page) for line, title, page in document.titles if line <= last},
        {row["line"]: (row["title"], row["page"]) for row in contents["titles"]},
    )


def compare_figures(comparison: Comparison) -> None:
    """Compare the tables of controllers, prefixes, addresses and formats."""
    document, lists = comparison.document, comparison.transcription.lists
    for section, (pages, pattern) in TABLES.items():
        read = {n for n in document.numbers(pages) if re.match(pattern, document[n].lstrip())}
        rows = {row[0]: row[1:] for row in lists[section]}
        for line in sorted(read | rows.keys()):
            printed = rows.get(line, [NOTHING])
            parts = [part for text in printed for part in text.split("…")]
            fits = line in read and contains(document[line], parts)
            text = printed if fits else document[line].strip()
            comparison.check(line, f"row of {section}", text, printed)


def compare_factors(comparison: Comparison) -> None:
    """Find every figure of the tables of conversion factors in the statements and scales of its row."""
    document = comparison.document
    stated: dict[int, set[str]] = {}
    for statement in comparison.transcription.statements:
        stated.setdefault(statement["line"], set()).update(statement["words"].split(" for "))
    for entry in comparison.transcription.examples.values():
        if entry["kind"] == "scaling":
            known = entry.get("arithmetic", "").split()
            stated.setdefault(entry["line"], set()).update(known)
    for number in document.numbers(FACTORS):
        cells = re.split(r"\s{2,}", document[number].strip())
        if len(cells) < 4 or not re.match(r"[A-Z0-9*-]+(?: Series)?(?: [\d.]+ ?m)?", cells[0]):
            continue
        figures = {found for cell in cells[1:] for found in re.findall(r"^[\d.,]+(?= \(|$)", cell)}
        for figure in sorted(figures):
            printed = figure if figure in stated.get(number, ()) else NOTHING
            comparison.check(number, "conversion factor", figure, printed)


def compare_words(comparison: Comparison) -> None:
    """Find the words of statements and the figures of ranges at their lines, and compare their pages."""
    document = comparison.document
    for statement in comparison.transcription.statements:
        text = document.passage(statement["line"])
        fits = all(has_words(text, part) for part in statement["words"].split(" for "))
        read = statement["words"] if fits else text
        comparison.check(statement["line"], "statement", read, statement["words"])
    for _, entry in comparison.transcription.messages:
        for limits in entry.get("ranges", []):
            text = document.passage(limits["line"], 7).casefold().replace("zero", "0")
            for key in ("from", "to", "fixed", "default"):
                if key in limits:
                    figure = re.escape(limits[key].casefold())
                    found = re.search(rf"(?<![\w.]){figure}(?:(?!\w|[.,]\d)|v\b)", text)
                    read = limits[key] if found else text[:40].rstrip()
                    comparison.check(limits["line"], "limit", read, limits[key])
        for place in (*entry.get("ranges", []), *entry.get("values", [])):
            line = place["line"]
            comparison.check(line, "page", document.page(line), place["page"])


def has_words(text: str, words: str) -> bool:
    """Whether a text of the document has the words of a statement."""
    parts = [re.escape(word).replace("\\-", r"-\s?") for word in plain(words).split()]
    pattern = rf"(?<!\w){SPACE.join(parts)}(?!\w)"
    return re.search(pattern, plain(text)) is not None


def compare_examples(comparison: Comparison) -> None:
    """Compare every printed frame with the examples on its line; … on the page stands for left out bytes."""
    document = comparison.document
    frames: dict[int, list[Data]] = {}
    for entry in comparison.transcription.examples.values():
        line = entry["line"]
        comparison.check(line, "page", document.page(line), entry["page"])
        if entry["kind"] in ("tx", "rx", "lost"):
            frames.setdefault(line, []).append(entry)
        elif entry["kind"] == "stream":
            text = document.passage(line)
            data = entry["printed"].replace(" ", r"\W+(?:0x)?")
            read = entry["printed"] if re.search(rf"(?<![1-9A-F]){data}(?!\w)", text) else text
            comparison.check(line, "bytes of a field", read, entry["printed"])
    for example in document.examples:
        if not comparison.covers(example.line):
            continue
        pattern = re.compile(example.data.replace("…", ".*"))
        entries = frames.pop(example.line, [])
        if not entries:
            comparison.check(example.line, "example", example.data, NOTHING)
        for entry in entries:
            data = " ".join(entry["printed"].split())
            read = data if pattern.fullmatch(data) else example.data
            mark = (
                example.kind.casefold() or entry["kind"]
            )  # some frames are printed without a mark
            comparison.check(example.line, "example", (mark, read), (entry["kind"], data))
    for line, entries in frames.items():
        for entry in entries:
            comparison.check(line, "example", NOTHING, (entry["kind"], entry["printed"]))

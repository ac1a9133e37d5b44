"""The transcription agrees with the program's reading of the document, place by place."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .extract import Place, Reading, Row, pairs, squash

Counts = Counter[str]
Data = Mapping[str, Any]


def at(reading: Reading, what: str) -> set[int]:
    return {place.line for place in reading.unreadable if place.what == what}


def places(node: Any) -> Iterator[tuple[int, int]]:
    """Yield the line and the page of every entry of the witness that has both."""
    if isinstance(node, dict):
        if isinstance(node.get("page"), int) and isinstance(node.get("line"), int):
            yield node["line"], node["page"]
        for value in node.values():
            yield from places(value)
    elif isinstance(node, list):
        for value in node:
            yield from places(value)


def raw(reading: Reading, line: int) -> str:
    """Return a line in the form of a damaged row of the witness: cells separated by |."""
    return tidy(reading.document[line].replace("\t", " | "))


def tidy(text: str) -> str:
    """Drop repeated blanks, and empty cells at the end."""
    return re.sub(r"\s+", " ", text).strip(" |")


def test_unreadable(reading: Reading, listed: Sequence[Data], compared: Counts) -> None:
    known = [Place(entry["line"], entry["what"]) for entry in listed]
    assert len(known) == len(set(known)), "a place is listed twice"
    assert all(entry["looked_at"].strip() for entry in listed)
    assert sorted(reading.unreadable - set(known)) == [], "cannot be read and is not listed"
    assert sorted(set(known) - reading.unreadable) == [], "is listed and can be read after all"
    compared["places that cannot be read, each listed"] = len(known)


def test_pages(reading: Reading, printed: Data, compared: Counts) -> None:
    found = sorted({place for content in printed.values() for place in places(content)})
    wrong = [
        (line, page, reading.document.pages(line))
        for line, page in found
        if not reading.document.pages(line)[0] <= page <= reading.document.pages(line)[1]
    ]
    assert wrong == []
    assert [page for _, page in found] == sorted(page for _, page in found)
    sure = sum(reading.document.sure(line) for line, _ in found)
    compared["lines with a page of the witness"] = len(found)
    compared["lines with a page of the witness, page sure"] = sure


def test_pages_of_all_lines(reading: Reading, compared: Counts) -> None:
    """Every line has a page; together they are the 138 pages of the document in order."""
    document = reading.document
    ranges = [document.pages(number) for number in document.numbers()]
    assert ranges == sorted(ranges)
    assert {page for low, high in ranges for page in range(low, high + 1)} == set(range(1, 139))
    compared["lines"] = len(ranges)
    compared["lines, page sure"] = sum(low == high for low, high in ranges)


def test_headings(reading: Reading, messages: Data, compared: Counts) -> None:
    found = {
        name: (line, printed_id)
        for heading in reading.headings
        for name, line, printed_id in zip(heading.names, heading.lines, heading.ids, strict=True)
    }
    expected = {
        name: (entry["heading"]["line"], entry["heading"]["id"]) for name, entry in messages.items()
    }
    assert found == expected
    compared["headings, name and id"] = len(found)


def test_contents(reading: Reading, printed: Data, compared: Counts) -> None:
    unreadable = at(reading, "contents row")
    found = {row.line: row for row in reading.contents}
    expected = {row["line"]: row for row in printed["contents"]["rows"]}
    assert found.keys() | unreadable == expected.keys()
    for line, row in expected.items():
        if row.get("damaged"):
            assert raw(reading, line) == tidy(row["text"]), line
            assert pairs(reading.document[line]) == [tuple(pair) for pair in row["names"]], line
        else:
            together = row.get("run_together", False)
            assert line not in unreadable, f"line {line} is whole in the witness"
            assert found[line] == Row(line, row["name"], row["id"], row.get("page", ""), together)
    compared["rows of the contents"] = len(expected)


def test_titles(reading: Reading, printed: Data, compared: Counts) -> None:
    expected = [
        (row["line"], row["title"], row.get("page", "")) for row in printed["contents"]["titles"]
    ]
    assert reading.titles == expected
    compared["titles of the contents"] = len(expected)


def test_overview(reading: Reading, printed: Data, compared: Counts) -> None:
    found = [(row.line, row.name, row.id) for row in reading.overview]
    expected = [(row["line"], row["name"], row["id"]) for row in printed["summary"]["rows"]]
    assert found == expected
    compared["rows of the overview"] = len(expected)


def test_mentions(reading: Reading, printed: Data, compared: Counts) -> None:
    found = [(line, name.replace("\\", "")) for line, name in reading.mentions]
    expected = [(row["line"], row["name"]) for row in printed["summary"]["mentions"]]
    assert found == expected
    compared["names in the running text"] = len(expected)


def test_lists(reading: Reading, printed: Data, compared: Counts) -> None:
    expected = printed["lists"]["lists"].values()
    assert {title: line for title, (line, _) in reading.lists.items()} == {
        entry["title"]: entry["line"] for entry in expected
    }
    unreadable = at(reading, "list row")
    for entry in expected:
        found = {row.line: row for row in reading.lists[entry["title"]][1]}
        rows = {row["line"]: row for row in entry["rows"]}
        assert found.keys() <= rows.keys()
        assert rows.keys() - found.keys() <= unreadable
        for line, row in rows.items():
            if row.get("damaged"):
                assert raw(reading, line) == tidy(row["text"]), line
            else:
                assert found[line] == Row(line, row["name"], row["id"], row.get("page", ""))
        compared["rows of the cross-reference lists"] += len(rows)


def byte_tables(messages: Data) -> dict[int, tuple[str, Data]]:
    return {
        table["line"]: (name, table)
        for name, entry in messages.items()
        for table in entry["tables"]
    }


def test_byte_tables(reading: Reading, messages: Data, compared: Counts) -> None:
    """Every table agrees in place, message, label, structure, packet and last number."""
    found = {
        table.line: (
            table.message,
            table.part,
            table.structure,
            table.packet,
            table.last_offset,
        )
        for table in reading.tables
    }
    expected = {
        line: (
            name,
            table["part"],
            table.get("structure"),
            table.get("packet"),
            table["last_offset"],
        )
        for line, (name, table) in byte_tables(messages).items()
    }
    assert found == expected
    compared["byte tables"] = len(found)


def test_header_cells(reading: Reading, messages: Data, compared: Counts) -> None:
    expected = byte_tables(messages)
    wrong = []
    for table in reading.tables:
        if table.line not in expected:
            continue  # test_byte_tables reports it
        cells = expected[table.line][1]["header"]
        assert len(table.header) == len(cells) == 6, table.line
        wrong += [
            (table.line, place, read, printed)
            for place, (read, printed) in enumerate(zip(table.header, cells, strict=True))
            if read is not None and read != printed
        ]
        compared["header cells"] += sum(read is not None for read in table.header)
    assert wrong == []


def same_names(found: Sequence[str | None], expected: Sequence[str]) -> bool:
    """Names agree except for blanks and case; an unreadable row matches any names."""
    if not found:
        return not expected
    if found[0] is None:
        return any(same_names(found[1:], expected[n:]) for n in range(len(expected) + 1))
    if not expected or squash(found[0]) != squash(expected[0]):
        return False
    return same_names(found[1:], expected[1:])


def test_data_names(reading: Reading, messages: Data, compared: Counts) -> None:
    expected = byte_tables(messages)
    wrong = []
    for table in reading.tables:
        if table.line not in expected:
            continue  # test_byte_tables reports it
        columns = [name for name in expected[table.line][1].get("columns", []) if name]
        if not same_names(table.columns, columns):
            wrong.append((table.line, table.columns, columns))
        compared["data names of byte tables"] += len([name for name in table.columns if name])
    assert wrong == []


def test_field_tables(reading: Reading, messages: Data, compared: Counts) -> None:
    """Names and formats of every field table agree, under the same heading."""
    headings = {name: heading for heading in reading.headings for name in heading.names}
    expected: dict[int, list[Any]] = {}
    for name, entry in messages.items():
        if entry.get("rows"):
            expected.setdefault(headings[name].line, []).append(entry["rows"])
    found: dict[int, list[Any]] = {}
    for table in reading.fields:
        line = max(heading.line for heading in reading.headings if heading.line < table.line)
        found.setdefault(line, []).append(table.rows)
    assert found.keys() == expected.keys()
    wrong = []
    for line, tables in found.items():
        assert len(tables) == len(expected[line]), line
        for rows, others in zip(tables, expected[line], strict=True):
            pairs_of_rows = zip(rows, others, strict=True)
            wrong += [
                (line, row, other)
                for row, other in pairs_of_rows
                if row is not None and list(row) != other
            ]
            compared["rows of field tables"] += sum(row is not None for row in rows)
    assert wrong == []

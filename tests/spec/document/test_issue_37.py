"""The transcription of Issue 37 agrees with the text of the document, apart from the places read by eye."""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools"))

from compare_document import checks, layout
from compare_document.__main__ import figures
from compare_document.comparison import BY_EYE, NOTHING, Comparison, Transcription, load, resolve
from compare_document.document import Document

from .conftest import path_of

EVEN_IF_CHANGED = {"numbers", "cell of the status bits", "page"}
"""Kinds with places that agree even if all texts of the transcription are wrong."""


@pytest.fixture(scope="module")
def document() -> Document:
    return layout.read(path_of("thorlabs_apt_issue_37"))


@pytest.fixture(scope="module")
def transcription() -> Transcription:
    return Transcription.load()


@pytest.fixture(scope="module")
def comparison(document: Document, transcription: Transcription) -> Comparison:
    return checks.compare(document, transcription)


def changed(transcription: Transcription, change: Callable[[Any], Any]) -> Transcription:
    """Return a transcription with a change of each of its texts or numbers."""

    def walk(node: Any) -> Any:
        if isinstance(node, dict):
            keys = ("line", "kind", "chapter")
            return {key: node[key] if key in keys else walk(node[key]) for key in node}
        if isinstance(node, (list, tuple)):
            return [walk(item) for item in node]
        return change(node)

    return Transcription(
        [(name, walk(entry)) for name, entry in transcription.messages],
        walk(transcription.lists),
        walk(transcription.contents),
        walk(transcription.statements),
        walk(transcription.examples),
    )


def message(transcription: Transcription, name: str) -> Any:
    return dict(transcription.messages)[name]


def test_each_difference_is_read_by_eye(comparison: Comparison) -> None:
    places = load(BY_EYE)["places"]
    assert resolve(comparison, places) == []
    assert [place["page"] for place in places] == [
        comparison.document.page(place["line"]) for place in places
    ]
    assert all(place["reason"].strip() for place in places)
    print("\n" + figures(comparison))


def test_an_entry_that_is_no_longer_needed_is_reported(comparison: Comparison) -> None:
    places = load(BY_EYE)["places"]
    stale = {"line": 1, "what": "heading", "read": "A", "printed": "B"}
    assert resolve(comparison, [*places, stale]) == [
        "line 1, heading: the entry of read_by_eye.yaml has no such difference"
    ]
    assert len(resolve(comparison, places[1:])) == 1


def test_each_wrong_text_is_reported(document: Document, transcription: Transcription) -> None:
    wrong = changed(transcription, lambda node: f"9{node}9" if isinstance(node, str) else node)
    found = checks.compare(document, wrong)
    assert {kind for kind, count in found.equal.items() if count} <= EVEN_IF_CHANGED
    assert found.read.keys() >= {"heading", "byte table", "header cell", "field", "value", "limit"}


def test_each_wrong_number_is_reported(document: Document, transcription: Transcription) -> None:
    wrong = changed(transcription, lambda node: node + 1 if type(node) is int else node)
    found = checks.compare(document, wrong)
    for kind in ("heading", "byte table", "page", "row of usb_prefixes"):
        assert found.read[kind] > 0
        assert found.equal[kind] == 0, kind


def test_single_changes_are_reported_at_their_places(
    document: Document, transcription: Transcription, comparison: Comparison
) -> None:
    wrong = copy.deepcopy(transcription)
    message(wrong, "MOT_SET_VELPARAMS")["tables"][0]["columns"][1:3] = [
        "Acceleration",
        "Min Velocity",
    ]
    message(wrong, "MOT_SET_VELPARAMS")["rows"][1][1] = "word"
    message(wrong, "MOT_REQ_POSCOUNTER")["tables"][0]["header"][3] = "01"
    message(wrong, "MOT_SET_JOGPARAMS")["heading"]["id"] = "0x0461"
    message(wrong, "MOT_SET_JOGPARAMS")["rows"].pop()
    message(wrong, "MOT_SET_LIMSWITCHPARAMS")["values"][0]["rows"][2][0] = "0x04"
    message(wrong, "MOT_SET_AVMODES")["values"][0]["rows"].pop()
    message(wrong, "MOD_SET_CHANENABLESTATE")["values"][1]["rows"].pop()
    message(wrong, "MOT_GET_USTATUSUPDATE")["values"][1]["rows"].pop(3)
    message(wrong, "MOT_MOVE_HOME")["tables"].clear()
    lists: Any = wrong.lists["lists"]
    lists["KST101"]["rows"].pop(0)
    lists["KIM101"]["rows"][2]["id"] = "0D"
    examples: Any = wrong.examples
    examples["i37-poscounter-set"]["printed"] = "10 04 06 00 A2 01 01 00 40 0D 03 01"
    del examples["i37-move-home"]
    found = set(checks.compare(document, wrong).differences) - set(comparison.differences)
    assert {(one.line, one.what) for one in found} >= {
        (3216, "name of data"),
        (3216, "sizes of data"),
        (3229, "field"),
        (3110, "header cell"),
        (3290, "heading"),
        (3336, "field"),
        (2318, "value"),
        (6286, "cell of the status bits"),
        (3932, "byte table"),
        (676, "row of a list"),
        (1404, "row of a list"),
        (3101, "example"),
        (3940, "example"),
    }
    assert any(one.what == "value" and 3837 <= one.line <= 3850 for one in found)


def test_text_that_is_not_transcribed_is_reported(
    document: Document, transcription: Transcription, comparison: Comparison
) -> None:
    wrong = replace(transcription, messages=transcription.messages[1:])
    found = set(checks.compare(document, wrong).differences) - set(comparison.differences)
    assert found
    assert {one.printed for one in found} == {NOTHING}


def test_a_page_that_cannot_be_read_is_reported(
    transcription: Transcription, tmp_path: Path
) -> None:
    text = path_of("thorlabs_apt_issue_37").read_text(encoding="utf-8")
    damaged = tmp_path / "text.txt"
    damaged.write_text(
        text.replace(" 23    02    Chan Ident    00      d      s", " 23    O2    Chan"),
        encoding="utf-8",
    )
    found = checks.compare(layout.read(damaged), transcription)
    assert [one.line for one in found.differences if one.what == "header cell"] == [2270] * 6


def test_a_wrong_value_of_a_list_is_reported(
    document: Document, transcription: Transcription
) -> None:
    wrong = copy.deepcopy(transcription)
    rows = [
        row for _, entry in wrong.messages for one in entry.get("values", []) for row in one["rows"]
    ]
    for row in rows[::20]:
        right = row[0]
        row[0] = f"{right[:-1]}{'7' if right.endswith('3') else '3'}"
        found = Comparison(document, wrong)
        checks.compare_values(found)
        assert found.differences, (right, row)
        row[0] = right


def test_sub_messages_are_compared_below_their_shared_heading(
    document: Document, transcription: Transcription
) -> None:
    part: Any = {
        "of": "QUAD_SET_PARAMS",
        "page": 336,
        "line": 15864,
        "title": "Set/Request/Get Quad_OperMode",
        "id": "07",
        "bytes": [15880, "0700"],
        "listed": [[15507, "Set/Request/Get Quad Operating Mode", "07"]],
    }
    table = {
        "page": 336,
        "line": 15872,
        "part": "SET",
        "structure": 14,
        "packet": 8,
        "last_offset": 9,
        "header": ["70", "08", "08", "00", "d|", "s"],
        "columns": ["SubMsgID", "Mode"],
    }
    entry: Any = {
        "heading": {"page": 328, "line": 15482, "id": "0x0870"},
        "sub_message": part,
        "tables": [table],
        "rows": [["SubMsg ID", "word"], ["Mode", "word"]],
    }
    lines = {15482, 15507, 15864, 15872, 15880, 15882}

    def differing() -> set[tuple[int, str]]:
        found = Comparison(document, replace(transcription, messages=[("QUAD_SET_MODE", entry)]))
        checks.compare_headings(found)
        checks.compare_sub_messages(found)
        checks.compare_tables(found)
        checks.compare_fields(found)
        return {(one.line, one.what) for one in found.differences if one.line in lines}

    assert differing() == set()
    part |= {"id": "08", "bytes": [15880, "0800"], "of": "QUAD_REQ_PARAMS"}
    part["listed"][0][2] = "08"
    entry["rows"][1] = ["Mode", "dword"]
    assert differing() == {
        (15482, "heading"),
        (15507, "sub-message"),
        (15864, "sub-message"),
        (15872, "byte table"),
        (15872, "sizes of data"),
        (15880, "bytes of a sub-message"),
        (15882, "field"),
    }


def test_numbers_of_sub_messages_are_read_as_printed(document: Document) -> None:
    read = {part.line: part.id for part in document.sub_messages}
    assert len(read) == 83
    assert [read[line] for line in (14406, 14680, 15613, 18698)] == [
        "10 [0A]",
        "17 (0x11)",
        "3",
        "2D",
    ]
    rows = {row.line: (row.name, row.id) for _, rows in document.lists.values() for row in rows}
    assert rows[1328] == ("Set/Request/Get Quad_KPADigOPs", "10")


def test_frames_are_read_with_other_punctuation(document: Document) -> None:
    frames = {example.line: (example.kind, example.data) for example in document.examples}
    assert frames[12039] == ("TX", "09 06 04 00 D0 01 FF 7F FF 7F")
    assert frames[12086] == ("TX", "12 06 00 00 50 01")
    assert frames[13952] == ("TX", "EB 07 08 00 D0 01 02 00 01 00 01 10 00 10")


def test_the_breakdown_of_a_frame_is_not_a_list_of_values(document: Document) -> None:
    lines = {value.line for value in document.values}
    assert not lines & set(range(12190, 12196))
    assert lines >= {12177, 12178, 12179}


def test_tables_without_blank_lines_labels_or_formats_are_read(document: Document) -> None:
    tables = {table.line: table for table in document.tables}
    assert tables[15543].header == ["70", "08", "08", "00", "d|", "s"]  # text follows at once
    assert (tables[16586].structure, tables[18461].structure) == (12, 32)  # 12bytes, 32 bytes
    assert tables[16655].lines == [16655, 16659]  # the second row is labelled "header only" too
    rows = {row.line: (row.name, row.format) for table in document.fields for row in table.rows}
    assert rows[16498] == ("Reserved", "")
    assert rows[18434] == ("Reserved", "6 words")


def test_values_after_an_equals_sign_or_in_quotation_marks_are_found(document: Document) -> None:
    for value, line in (("4", 17572), ("2", 17759)):
        assert next(checks.find_value(document, (line, 0), value))[0] == line


def test_values_named_before_an_equals_sign_and_rows_of_bits_without_a_mask_are_compared(
    document: Document, transcription: Transcription
) -> None:
    values = {value.line: value.value for value in document.values}
    assert [values[line] for line in (10063, 10064, 10095, 10132)] == ["0", "1", "1", "1"]
    wrong = copy.deepcopy(transcription)
    bits = message(wrong, "PZ_GET_PZSTATUSBITS")["values"]
    assert bits[0]["rows"][6][:2] == ["", "10"]
    bits[0]["rows"][6][1] = "14"
    message(wrong, "PZ_SET_PPC_IOSETTINGS")["values"][0]["rows"].pop()
    found = Comparison(document, wrong)
    checks.compare_values(found)
    assert {one.line for one in found.differences} >= {9630, 10066}


def test_a_label_right_below_a_table_is_not_a_cell(document: Document) -> None:
    tables = {table.line: table for table in document.tables}
    assert tables[11375].header == ["F4", "07", "01", "00", "d", "s"]
    assert tables[11382].part == "GET"


def test_chapters_count_one_by_one(document: Document, transcription: Transcription) -> None:
    last = [(name, one) for name, one in transcription.messages if one["heading"]["page"] > 409]
    found = Comparison(document, replace(transcription, messages=last))
    assert found.covers(19373)
    assert not found.covers(9250)

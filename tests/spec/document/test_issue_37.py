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

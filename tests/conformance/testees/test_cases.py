"""The Python testee answers the cases of the vectors; a wrong testee is found."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest
from jsonschema_rs import Draft202012Validator
from testee_calls import SCHEMA

from checkout import ROOT
from markdown_blocks import blocks
from stagewire.protocols import available_protocols, load_protocol
from stagewire_conformance.comparison import mismatches
from stagewire_conformance.testee import Testee

NAMES = [
    name
    for name in available_protocols()
    if load_protocol(name).package in ("stagewire_apt", "stagewire_ms2000")
]


def cases(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = load_protocol(name).vectors()["cases"]
    return found


@pytest.mark.parametrize("name", NAMES)
def test_the_testee_answers_every_case(name: str) -> None:
    assert len(cases(name)) > 1000
    assert [str(wrong) for wrong in mismatches(Testee(), name, cases(name))] == []


@pytest.mark.parametrize("name", NAMES)
def test_cases_conform_to_the_testee_protocol(name: str) -> None:
    """Requests match the schema if they are granted or refused because of a value; answers always match."""
    request_of, answer_of = (
        Draft202012Validator({"$ref": f"#/$defs/{part}", "$defs": SCHEMA["$defs"]})
        for part in ("request", "answer")
    )
    for case in cases(name):
        request = {"id": 1, "protocol": name, **case["request"]}
        wrong = case["answer"].get("error") in ("bad_request", "unsupported")
        assert wrong or request_of.is_valid(request), case["id"]
        detail = {} if case["answer"]["ok"] else {"detail": "why"}
        assert answer_of.is_valid({"id": 1, **detail, **case["answer"]}), case["id"]


class Wrong:
    """The Python testee with a changed answer."""

    def __init__(self, change: str) -> None:
        self._testee = Testee()
        self._change = change

    def answer(self, line: bytes) -> Mapping[str, Any]:
        answer = self._testee.answer(line)
        return getattr(self, self._change)(answer)

    def true_for_one(self, answer: dict[str, Any]) -> dict[str, Any]:
        if "fields" not in answer:
            return answer
        fields = {k: True if v == 1 else v for k, v in answer["fields"].items()}
        return {**answer, "fields": fields}

    def no_detail(self, answer: dict[str, Any]) -> dict[str, Any]:
        return {key: value for key, value in answer.items() if key != "detail"}

    def another_id(self, answer: dict[str, Any]) -> dict[str, Any]:
        return {**answer, "id": -1}

    def another_code(self, answer: dict[str, Any]) -> dict[str, Any]:
        return {**answer, "error": "bad_value"} if answer.get("error") == "bad_length" else answer

    def a_byte_more(self, answer: dict[str, Any]) -> dict[str, Any]:
        return {**answer, "hex": answer["hex"] + "00"} if "hex" in answer else answer

    def a_detail_too_many(self, answer: dict[str, Any]) -> dict[str, Any]:
        return {"detail": "fine", **answer}


@pytest.mark.parametrize(
    "change", [name for name in vars(Wrong) if not name.startswith("_") and name != "answer"]
)
def test_a_wrong_testee_is_found(change: str) -> None:
    name, some_messages = "thorlabs_apt", ("MOD_GET_CHANENABLESTATE/", "MOT_GET_VELPARAMS/")
    some = [case for case in cases(name) if case["id"].startswith(some_messages)]
    assert some, "the cases have other names"
    found = list(mismatches(Wrong(change), name, some))
    assert found
    assert all(wrong.id in str(wrong) for wrong in found)


def test_ids_are_unique() -> None:
    for name in NAMES:
        ids = [case["id"] for case in cases(name)]
        assert len(set(ids)) == len(ids)
        assert json.dumps(ids).isascii()


def test_the_page_about_vectors_is_correct() -> None:
    """The case on the page is in the file, and the program on the page runs."""
    page = {
        block.language: block.text for block in blocks(ROOT / "docs" / "reference" / "vectors.md")
    }
    assert page.keys() == {"json", "python"}
    assert json.loads(page["json"]) in cases("thorlabs_apt")
    exec(compile(page["python"], "docs/reference/vectors.md", "exec"), {})

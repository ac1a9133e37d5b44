"""The JSON and JUnit reports: they satisfy their schemas and are complete."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from sample_sheets import (
    CAME,
    DEVIATING,
    FAILED,
    FRAGILE,
    HOSTILE,
    NOT_RUN,
    NOTED,
    PASSED,
    SKIPPED,
    WANTED,
    hostile,
    sheet,
)

from checkout import SCHEMAS
from stagewire_conformance.reports import (
    Finding,
    Grade,
    Sheet,
    Verdict,
    as_html,
    as_json,
    as_junit,
)

HERE = Path(__file__).parent
SCHEMA = json.loads((SCHEMAS / "conformance-report.schema.json").read_text(encoding="utf-8"))
SHEETS = {
    "all": sheet(),
    "one": sheet(PASSED),
    "cut short": sheet(PASSED, unfinished="the plug was pulled"),
    "nothing": sheet(NOT_RUN, unfinished="nothing answers"),
    "hostile": replace(hostile(), digests={}),
}


@cache
def junit_schema() -> Any:
    import xmlschema  # slow to import

    return xmlschema.XMLSchema(HERE / "junit.xsd")


def data(made: Sheet) -> Any:
    text = as_json(made)
    assert text.isascii()
    return json.loads(text)


@pytest.mark.parametrize("made", SHEETS.values(), ids=SHEETS)
def test_json_satisfies_its_schema(made: Sheet) -> None:
    checker = jsonschema.FormatChecker()
    jsonschema.Draft202012Validator(SCHEMA, format_checker=checker).validate(data(made))


def test_the_schema_describes_everything_and_allows_nothing_else() -> None:
    def walk(part: Any) -> None:
        if isinstance(part, list):
            for one in part:
                walk(one)
        if not isinstance(part, dict):
            return
        if isinstance(part.get("properties"), dict) and part.get("type") == "object":
            assert part["additionalProperties"] is False
            assert set(part["required"]) == set(part["properties"])
        for one in part.values():
            walk(one)

    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    walk(SCHEMA)


def test_json_has_everything() -> None:
    found = data(sheet())
    assert found["verdict"] == "FAILED"
    assert found["digests"] == {"suite": "ab" * 32, "pics": "cd" * 32}
    assert found["facts"]["serial_number"] == 83000001
    assert (found["seed"], found["unfinished"]) == (7, None)
    assert found["counts"] == dict.fromkeys(map(str, Grade), 1)
    cases = {case["id"]: case for group in found["groups"] for case in group["cases"]}
    failed = cases[FAILED.id]
    assert failed["result"] == "FAIL"
    assert [finding["rule"] for finding in failed["findings"]] == ["request-answered", None, None]
    assert failed["findings"][0]["wanted"] == {"hex": WANTED.hex()}
    assert failed["findings"][0]["came"] == {"hex": CAME.hex()}
    assert failed["figures"] == {"p99_ms": 3.25}
    assert [line["sent"] for line in failed["lines"]] == [True, True, False]
    assert failed["repeat"] == FAILED.repeat
    assert cases[SKIPPED.id]["why"] == "no potentiometer"
    messages = {row["name"]: row for row in found["coverage"]["messages"]}
    assert messages["MOT_REQ_VELPARAMS"]["counts"]["failed"] == 1
    assert messages["MOT_REQ_POTPARAMS"]["unsupported"] == "no potentiometer"
    places = {row["number"]: row for row in found["coverage"]["places"]}
    assert list(places) == [9, 30]
    assert places[9]["rules"]["request-answered"]["failed"] == 1
    assert places[9]["rules"]["unseen"] == dict.fromkeys(map(str, Grade), 0)
    assert places[30]["counts"]["failed"] == 1
    assert places[30]["counts"]["passed"] == 0


@pytest.mark.parametrize("made", SHEETS.values(), ids=SHEETS)
def test_junit_satisfies_its_schema(made: Sheet) -> None:
    text = as_junit(made)
    assert text.isascii()
    junit_schema().validate(text)


def suites(made: Sheet) -> dict[str, ElementTree.Element]:
    return {suite.get("name", ""): suite for suite in ElementTree.fromstring(as_junit(made))}


def test_junit_has_a_test_case_with_the_result_of_each_case() -> None:
    results = {}
    for suite in suites(sheet()).values():
        for case in suite.iter("testcase"):
            results[case.get("name")] = [(found.tag, found.get("type")) for found in case]
    assert results == {
        PASSED.id: [],
        FAILED.id: [("failure", "FAIL")],
        DEVIATING.id: [("failure", "NON-STRICT")],
        FRAGILE.id: [],
        NOTED.id: [],
        SKIPPED.id: [("skipped", "SKIP")],
        NOT_RUN.id: [("skipped", "NOT RUN")],
        "run finished": [],
    }


def test_junit_counts_are_right() -> None:
    answers = suites(sheet())["answers"]
    counts = {name: answers.get(name) for name in ("tests", "failures", "errors", "skipped")}
    assert counts == {"tests": "2", "failures": "1", "errors": "0", "skipped": "0"}
    assert float(answers.get("time", "")) == pytest.approx(PASSED.seconds + FAILED.seconds)
    assert answers.get("timestamp") == "2020-01-02T03:04:05"


def test_a_failure_in_junit_has_bytes_rule_page_and_command() -> None:
    failure = suites(sheet())["answers"].find(".//failure")
    assert failure is not None
    text = failure.text or ""
    assert failure.get("message") == "channel 2 came, not 1"
    for part in (
        "expected   0  15 04 0E 00 81 50 01 00",
        "received      15 04 0E 00 81 50 02 00",
        "^^",
        "rule request-answered (must, page 9): A request is answered.",
        "erratum apt-a-misprint",
        "> 14 04 01 00 50 01  # MOT_REQ_VELPARAMS",
        FAILED.repeat,
    ):
        assert part in text, part


def test_a_finding_cites_the_pages_of_the_messages_that_it_names() -> None:
    finding = replace(FAILED.findings[0], text="MOT_REQ_VELPARAMS and NOT_A_MESSAGE were sent")
    made = sheet(replace(FAILED, findings=(finding,)))
    text = suites(made)["answers"].findtext(".//failure") or ""
    assert [line for line in text.splitlines() if line.startswith("message ")] == [
        "message MOT_REQ_VELPARAMS (page 30)"
    ]
    assert "Described in the document: MOT_REQ_VELPARAMS (page 30)" in as_html(made)


def test_a_departure_from_a_must_is_explained() -> None:
    finding = replace(FAILED.findings[0], grade=Grade.DEVIATES)
    deviates = replace(FAILED, grade=Grade.DEVIATES, word="NON-STRICT", findings=(finding,))
    said = "NON-STRICT, although the rule says must: hosts can work with this departure"
    for case, expected in ((deviates, True), (FAILED, False)):
        made = sheet(case)
        text = suites(made)["answers"].findtext(".//failure") or ""
        assert [said in each for each in (text, as_html(made))] == [expected, expected]


def test_an_unfinished_run_is_an_error_in_junit() -> None:
    error = suites(sheet(PASSED, unfinished="the plug was pulled"))["run"].find(".//error")
    assert error is not None
    assert error.get("message") == "the plug was pulled"


def test_text_from_a_controller_stays_text() -> None:
    text = as_junit(hostile())
    assert "<script" not in text
    assert not [c for c in text if not c.isprintable() and c != "\n"]
    assert HOSTILE not in "".join(ElementTree.fromstring(text).itertext())


@pytest.mark.parametrize(
    ("cases", "unfinished", "verdict"),
    [
        ((PASSED, NOTED, SKIPPED), "", Verdict.PASSED),
        ((PASSED, NOTED, SKIPPED, NOT_RUN), "", Verdict.PARTIAL),
        ((PASSED, DEVIATING), "", Verdict.NON_STRICT),
        ((PASSED, DEVIATING), "the line was lost", Verdict.UNFINISHED),
        ((FAILED, DEVIATING), "", Verdict.FAILED),
        ((FAILED, PASSED), "the line was lost", Verdict.FAILED),
    ],
)
def test_verdicts(cases: tuple[Any, ...], unfinished: str, verdict: Verdict) -> None:
    assert sheet(*cases, unfinished=unfinished).verdict is verdict


def test_a_figure_that_is_not_a_number_is_omitted_from_json() -> None:
    odd = replace(PASSED, figures={"p50_ms": 1.5, "p99_ms": float("nan"), "rate_hz": float("inf")})
    assert data(sheet(odd))["groups"][0]["cases"][0]["figures"] == {"p50_ms": 1.5}
    junit_schema().validate(as_junit(sheet(odd)))


def test_findings_may_have_texts_instead_of_bytes() -> None:
    finding = Finding(grade=Grade.FAILED, text="answered wrongly", wanted="[1]", came='{"a": 2}')
    made = sheet(replace(FAILED, findings=(finding,)))
    (found,) = data(made)["groups"][0]["cases"][0]["findings"]
    assert (found["wanted"], found["came"]) == ({"text": "[1]"}, {"text": '{"a": 2}'})
    assert "  expected [1]\n  received {" in as_junit(made).replace("&quot;", '"')


@pytest.mark.parametrize("unfinished", ["", "the output of 0x50 was on; 0x21 still moves", "lost"])
def test_junit_fails_if_parts_are_not_at_rest(unfinished: str) -> None:
    parts = ("the output of 0x50 was on", "0x21 still moves")
    made = replace(sheet(PASSED), adrift=parts, unfinished=unfinished)
    assert (made.verdict, made.exit_status) == (Verdict.UNFINISHED, 4)
    suites = list(ElementTree.fromstring(as_junit(made)).iter("testsuite"))
    (error,) = suites[-1].iter("error")
    harm = "Make sure that it cannot do harm."
    ended = "; lost" if unfinished == "lost" else ""
    assert (
        error.get("message") == "; ".join(f"NOT AT REST: {text}. {harm}" for text in parts) + ended
    )
    said = {suite.get("name"): suite.findtext("system-out") for suite in suites}
    assert said.pop("run") == (
        "NOT AT REST: the output of 0x50 was on. Make sure that it cannot do harm.\n"
        "NOT AT REST: 0x21 still moves. Make sure that it cannot do harm."
    )
    assert not any(said.values())

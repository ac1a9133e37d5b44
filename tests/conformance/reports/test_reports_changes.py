"""Changes between two JSON reports: results, findings, rules, completeness, and unreadable files."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema_rs import Draft202012Validator
from sample_sheets import DEVIATING, FAILED, NOT_RUN, NOTED, PASSED, SKIPPED, hostile, sheet

from checkout import SCHEMAS
from stagewire_conformance.reports import Case, Fact, Finding, Grade, Sheet, as_json
from stagewire_conformance.reports.changes import (
    Change,
    Changes,
    changes_as_json,
    changes_as_text,
    compare,
)
from stagewire_conformance.reports.json_reader import ReportFileError, read_run

SCHEMA = json.loads((SCHEMAS / "conformance-changes.schema.json").read_text(encoding="utf-8"))
VALIDATOR = Draft202012Validator(SCHEMA)

Between = Callable[[Sheet, Sheet], Changes]


@pytest.fixture
def between(tmp_path: Path) -> Between:
    """Return the changes between two sheets, through their files."""

    def between(old: Sheet, new: Sheet) -> Changes:
        runs = []
        for name, one in (("old", old), ("new", new)):
            path = tmp_path / f"{name}.json"
            path.write_text(as_json(one), encoding="utf-8")
            runs.append(read_run(path))
        changes = compare(*runs)
        VALIDATOR.validate(json.loads(changes_as_json(changes)))
        return changes

    return between


def result(case: Case, **changes: Any) -> Case:
    """Return a case under the id of the passed one."""
    return replace(case, id=PASSED.id, **changes)


WORSE, BETTER, OTHER = Change.WORSE, Change.BETTER, Change.OTHER


@pytest.mark.parametrize(
    ("old", "new", "change"),
    [
        (PASSED, FAILED, WORSE),
        (PASSED, DEVIATING, WORSE),
        (DEVIATING, FAILED, WORSE),
        (SKIPPED, FAILED, WORSE),
        (NOTED, DEVIATING, WORSE),
        (PASSED, SKIPPED, WORSE),
        (PASSED, NOT_RUN, WORSE),
        (FAILED, PASSED, BETTER),
        (FAILED, DEVIATING, BETTER),
        (DEVIATING, NOTED, BETTER),
        (NOT_RUN, PASSED, BETTER),
        (FAILED, NOT_RUN, OTHER),  # no improvement: it is no longer tested
        (FAILED, SKIPPED, OTHER),
        (PASSED, NOTED, OTHER),
    ],
    ids=lambda value: value.word if isinstance(value, Case) else str(value),
)
def test_a_change_is_worse_better_or_other(
    between: Between, old: Case, new: Case, change: Change
) -> None:
    changes = between(sheet(result(old), NOTED), sheet(result(new), NOTED))
    (found,) = changes.cases
    assert (found.id, found.change, found.old, found.new) == (PASSED.id, change, old.word, new.word)
    assert changes.same == 1
    assert changes.worse == (change is WORSE or new.grade in (Grade.NOT_RUN,))


def test_equal_reports_have_no_changes(between: Between) -> None:
    changes = between(sheet(), sheet())
    assert (changes.cases, changes.facts, changes.inputs, changes.worse) == ((), (), (), False)
    assert [*changes_as_text(changes)][-1].startswith("UNCHANGED: FAILED (partial run) -> FAILED")


def test_findings_are_compared_without_their_numbers(between: Between) -> None:
    def failed(*texts: str) -> Sheet:
        findings = tuple(Finding(grade=Grade.FAILED, text=text) for text in texts)
        return sheet(replace(FAILED, findings=findings))

    slow, lost = "0x50 answered after 12.5 ms", "0x50 did not answer"
    assert between(failed(slow), failed("0x51 answered after 1,013 ms")).cases == ()
    (more,) = between(failed(slow), failed(slow, lost)).cases
    assert (more.change, [f.text for f in more.new_findings]) == (WORSE, [lost])
    (less,) = between(failed(slow, lost), failed(slow)).cases
    assert (less.change, [f.text for f in less.gone_findings]) == (BETTER, [lost])


def test_cases_of_one_report_only(between: Between) -> None:
    assert [c.change for c in between(sheet(NOTED), sheet(NOTED, PASSED)).cases] == [Change.NEW]
    assert [c.change for c in between(sheet(NOTED), sheet(NOTED, FAILED)).cases] == [WORSE]
    assert [c.change for c in between(sheet(NOTED, PASSED), sheet(NOTED)).cases] == [WORSE]
    assert [c.change for c in between(sheet(NOTED, FAILED), sheet(NOTED)).cases] == [Change.GONE]


def test_broken_rules(between: Between) -> None:
    changes = between(sheet(PASSED), sheet(PASSED, FAILED))
    assert (changes.broken, changes.fixed) == (("request-answered",), ())
    back = between(sheet(PASSED, FAILED), sheet(PASSED))
    assert (back.broken, back.fixed) == ((), ("request-answered",))


def test_a_run_that_is_no_longer_complete_is_worse(between: Between) -> None:
    changes = between(sheet(PASSED), sheet(PASSED, unselected=3))
    assert (changes.cases, changes.worse) == ((), True)
    assert changes.new_gaps == ("not selected",)
    assert not between(sheet(PASSED, unselected=3), sheet(PASSED)).worse


def test_facts_and_inputs_that_differ(between: Between) -> None:
    old = sheet(PASSED)
    facts = (*old.facts[:-1], Fact(key="firmware", label="Firmware", value="1.3"))
    new = replace(old, facts=facts, digests={"suite": "ef" * 32})
    changes = between(old, new)
    assert [(each.name, each.old, each.new) for each in changes.facts] == [
        ("firmware", None, "1.3")
    ]
    assert {each.name for each in changes.inputs} == {"suite", "pics"}
    text = [*changes_as_text(changes)]
    assert "firmware: nothing -> 1.3" in text
    assert any("the registry differs" in line for line in text)


def test_texts_of_a_malicious_report_are_kept(between: Between) -> None:
    assert between(sheet(), hostile()).worse


@pytest.mark.parametrize(
    ("contents", "problem"),
    [
        (b"", "not a JSON file"),
        (b"\xff\xfe", "not a JSON file"),
        (b"[" * 100_000, "nested too deeply"),
        (b"null", "not a conformance report"),
        (b"[]", "not a conformance report"),
        (b'{"groups": []}', "the report has the format None; expected 1"),
        (b'{"groups": [], "schema_version": true}', "the report has the format True"),
        (b'{"groups": [], "schema_version": 1}', "'complete' is missing"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, contents: bytes, problem: str) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(contents)
    with pytest.raises(ReportFileError) as caught:
        read_run(path)
    assert problem in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_report_with_any_damaged_key_is_refused_without_a_traceback(tmp_path: Path) -> None:
    """Each value is replaced by others in turn; a report is read, or refused with one error."""
    whole = json.loads(as_json(sheet()))
    path = tmp_path / "x.json"
    refused = 0
    for keys in _paths({key: whole[key] for key in whole if key not in ("coverage", "errata")}):
        for value in (None, True, 1, "x", [], {}, [1], {"a": 1}):
            path.write_text(json.dumps(_put(whole, keys, value)), encoding="utf-8")
            try:
                run = read_run(path)
                [*changes_as_text(compare(run, run))]
            except ReportFileError:
                refused += 1
    assert refused > 200


def _paths(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    entries = value.items() if isinstance(value, dict) else ()
    entries = enumerate(value[:2]) if isinstance(value, list) else entries
    return [at, *(path for key, inner in entries for path in _paths(inner, (*at, key)))]


def _put(document: Any, keys: tuple[Any, ...], value: Any) -> Any:
    if not keys:
        return value
    first, *rest = keys
    made = dict(document) if isinstance(document, dict) else list(document)
    made[first] = _put(document[first], tuple(rest), value)
    return made


def test_reports_of_different_kinds_are_refused(between: Between) -> None:
    with pytest.raises(
        ReportFileError, match="a report of a device cannot be compared with one of a"
    ):
        between(sheet(), sheet(kind="codec"))

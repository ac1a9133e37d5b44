"""Every report states whether a run was complete or partial, and why."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import jsonschema
import pytest
from sample_sheets import DEVIATING, FAILED, NOT_RUN, PASSED, SKIPPED, sheet

from checkout import SCHEMAS
from stagewire_conformance.device.execution import execute
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.reports import (
    Gap,
    Omission,
    Sheet,
    Verdict,
    as_html,
    as_json,
    as_junit,
)
from stagewire_conformance.reports.device_sheet import sheet_of_execution
from stagewire_conformance.reports.text import sentence

SCHEMA = json.loads((SCHEMAS / "conformance-report.schema.json").read_text(encoding="utf-8"))

FORBIDDEN = replace(
    NOT_RUN,
    id="a/1",
    omission=Omission.PERMISSION,
    why="not allowed: needs --allow-settings",
)
IMPOSSIBLE = replace(NOT_RUN, id="a/2", why="its scale is unknown")
UNREACHED = replace(NOT_RUN, id="a/3", omission=Omission.ENDED, why="not reached: no line")
DEPENDENT = replace(NOT_RUN, id="a/4", omission=Omission.CAUSE, why="see identification/0x50")

PARTIAL: dict[str, tuple[Sheet, Omission, str]] = {
    "selected": (sheet(PASSED, unselected=48), Omission.SELECTION, "48 not selected"),
    "permission": (sheet(PASSED, FORBIDDEN), Omission.PERMISSION, f"1 {FORBIDDEN.why}"),
    "impossible": (sheet(PASSED, IMPOSSIBLE), Omission.IMPOSSIBLE, f"1 not run: {IMPOSSIBLE.why}"),
    "cause": (sheet(FAILED, DEPENDENT), Omission.CAUSE, f"1 not run: {DEPENDENT.why}"),
    "line lost": (
        sheet(PASSED, UNREACHED, unfinished="the line was lost"),
        Omission.ENDED,
        "1 not run: the line was lost",
    ),
    "interrupted": (
        sheet(PASSED, UNREACHED, unfinished="ended by SIGINT", interrupted=True),
        Omission.INTERRUPTED,
        "1 not run: ended by SIGINT",
    ),
    "last case cut short": (
        sheet(PASSED, unfinished="ended by SIGINT", interrupted=True),
        Omission.INTERRUPTED,
        "partial run: ended by SIGINT",
    ),
}


def read(made: Sheet) -> Any:
    found = json.loads(as_json(made))
    jsonschema.Draft202012Validator(SCHEMA).validate(found)
    return found


def properties(made: Sheet) -> dict[str | None, str | None]:
    return {
        one.get("name"): one.get("value")
        for one in ElementTree.fromstring(as_junit(made)).iter("property")
    }


@pytest.mark.parametrize(("made", "omission", "words"), PARTIAL.values(), ids=PARTIAL)
def test_every_report_of_a_partial_run_states_why(
    made: Sheet, omission: Omission, words: str
) -> None:
    assert made.verdict is not Verdict.PASSED
    assert made.headline == f"{made.verdict} (partial run)"
    assert words in sentence(made)
    found = read(made)
    assert (found["complete"], found["headline"]) == (False, made.headline)
    assert [gap["omission"] for gap in found["gaps"]] == [omission]
    assert words in found["summary"]
    noted = properties(made)
    assert (noted["complete"], noted["headline"]) == ("false", made.headline)
    assert noted["partial_because"]
    page = as_html(made)
    assert f"<title>{made.title}: {made.headline}</title>" in page
    header = page.partition("<main")[0]
    assert made.headline in header
    assert words in header
    assert 'class="verdict good"' not in page


@pytest.mark.parametrize(
    ("made", "verdict"),
    [
        (sheet(PASSED, SKIPPED), "PASSED"),
        (sheet(PASSED, DEVIATING), "NON-STRICT"),
        (sheet(PASSED, FAILED), "FAILED"),
    ],
)
def test_every_report_of_a_complete_run_says_so(made: Sheet, verdict: str) -> None:
    """A case that the PICS skips does not make a run partial."""
    assert made.complete
    assert made.headline == f"{verdict} (complete run)"
    found = read(made)
    assert (found["complete"], found["gaps"]) == (True, [])
    noted = properties(made)
    assert (noted["complete"], noted["partial_because"]) == ("true", "")
    assert f"<title>{made.title}: {verdict} (complete run)</title>" in as_html(made)
    assert "partial" not in sentence(made)


def test_the_schema_refuses_a_partial_run_that_passed() -> None:
    found = read(sheet(PASSED, unselected=1))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(SCHEMA).validate({**found, "verdict": "PASSED"})
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(SCHEMA).validate({**found, "complete": True})


def test_reasons_are_sorted_by_kind_and_counted() -> None:
    made = sheet(
        PASSED, UNREACHED, IMPOSSIBLE, FORBIDDEN, replace(FORBIDDEN, id="a/5"), unselected=3,
        unfinished="the line was lost",
    )  # fmt: skip
    assert made.gaps == (
        Gap(omission=Omission.SELECTION, why="not selected", cases=3),
        Gap(omission=Omission.PERMISSION, why=FORBIDDEN.why, cases=2),
        Gap(omission=Omission.IMPOSSIBLE, why=IMPOSSIBLE.why, cases=1),
        Gap(omission=Omission.ENDED, why="the line was lost", cases=1),
    )


def test_a_selection_of_checks_is_a_partial_run() -> None:
    every = Plan.of("TDC001", Permissions())
    plan = Plan.of("TDC001", Permissions(), only=["identification"])
    made = sheet_of_execution(execute("virtual://TDC001", plan))
    assert (str(made.verdict), made.exit_status) == ("PASSED IN PART", 0)
    assert made.gaps == (
        Gap(
            omission=Omission.SELECTION,
            why="not selected",
            cases=len(every.checks) - len(plan.checks),
        ),
    )


def test_a_pattern_that_selects_everything_is_not_a_partial_selection() -> None:
    assert Plan.of("TDC001", Permissions(), only="*").unselected == 0

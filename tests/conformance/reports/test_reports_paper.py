"""The HTML report on paper: the number of its A4 pages, counted by WeasyPrint."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from sample_sheets import FAILED, NOT_RUN, sheet

import allowances
from stagewire_conformance.device.execution import execute
from stagewire_conformance.device.permissions import Range
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.reports import Fact, Omission, Sheet, Verdict, as_html
from stagewire_conformance.reports.device_sheet import sheet_of_execution

pytestmark = [pytest.mark.matrix, pytest.mark.proof]  # the runs take minutes in real time

CERTIFICATE = """
[certificate]
vendor = "Example Optics"
product = "Controller"
revision = "board C, firmware 1.3"
tester = "Test laboratory"
"""
CUBE = f"""schema_version = 1
unit = "TDC001"
[unsupported]
MOT_REQ_POTPARAMS = "no potentiometer fitted"
MOT_SET_POTPARAMS = "no potentiometer fitted"
[[channel]]
stage = "Z8"
travel = "0..12mm"
{CERTIFICATE}"""
RACK = f"""schema_version = 1
unit = "BBD102"
[[channel]]
bay = 1
stage = "MLS203"
travel = "0..110mm"
[[channel]]
bay = 2
stage = "MLS203"
travel = "0..110mm"
{CERTIFICATE}"""
AXES = f"""schema_version = 1
unit = "MS2000"
[[channel]]
axis = "X"
travel = "-50..50mm"
[[channel]]
axis = "Y"
travel = "-50..50mm"
{CERTIFICATE}"""

# name -> (URL, PICS, range of motion, most pages)
RUNS: Mapping[str, tuple[str, str, str, int]] = {
    "cube": ("virtual://TDC001?stage=Z8", CUBE, "0..5mm", 12),
    "rack": ("virtual://BBD102?stage=MLS203", RACK, "0..40mm", 16),
    "axes": ("virtual://MS2000", AXES, "-20..20mm", 12),
}


def pages_of(made: Sheet) -> tuple[int, dict[str, int]]:
    """Return the number of pages, and the page on which each section begins."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of missing libraries that only PDF files need
        try:
            import weasyprint
        except OSError as error:  # Pango is missing
            pytest.skip(f"WeasyPrint cannot be loaded: {error}")
    pages = weasyprint.HTML(string=as_html(made)).render().pages
    begins = {anchor: number for number, page in enumerate(pages, 1) for anchor in page.anchors}
    width, height = pages[0].width, pages[0].height  # in CSS pixels
    assert (round(width / 96 * 25.4), round(height / 96 * 25.4)) == (210, 297)
    return len(pages), begins


def run(url: str, pics: str, motion: str, folder: Path) -> Sheet:
    path = folder / "pics.toml"
    path.write_text(pics, encoding="utf-8")
    allowed = allowances.everything(Range.parse(motion))
    return sheet_of_execution(execute(url, Plan.of(None, allowed, pics=path)))


@pytest.mark.parametrize("name", RUNS)
def test_the_report_of_a_passed_run_is_short(name: str, tmp_path: Path) -> None:
    url, pics, motion, most = RUNS[name]
    made = run(url, pics, motion, tmp_path)
    assert made.verdict in (Verdict.PASSED, Verdict.PARTIAL)
    pages, begins = pages_of(made)
    assert pages <= most
    assert begins["summary"] == 1
    assert begins["pics"] <= 3  # the summary has two pages
    assert begins["run"] - begins["matrix"] < 5


def test_the_matrix_of_a_failed_run_is_short(tmp_path: Path) -> None:
    """With failures, all columns are present."""
    _, pics, motion, _ = RUNS["rack"]
    url = "virtual://BBD102?stage=MLS203&faults=to_host drop frame message=MOT_GET_VELPARAMS"
    made = run(url, pics, motion, tmp_path)
    assert made.verdict is Verdict.FAILED
    _, begins = pages_of(made)
    assert begins["pics"] <= 3
    assert begins["run"] - begins["matrix"] < 5


def test_the_summary_has_two_pages_in_the_worst_case() -> None:
    """It is bounded, however many reasons, facts and motions there are."""
    long = "a very long reason " * 40
    reasons = [
        replace(NOT_RUN, id=f"move/{n}", why=f"{n} {long}", omission=Omission.IMPOSSIBLE)
        for n in range(30)
    ]
    facts = tuple(Fact(key=f"place_{n}", label=f"At {n:#04x}", value=long) for n in range(12))
    adrift = tuple(f"0x50 channel {n}" for n in range(20))
    made = sheet(FAILED, *reasons, facts=facts, adrift=adrift, unfinished=long)
    _, begins = pages_of(made)
    assert begins["pics"] <= 3

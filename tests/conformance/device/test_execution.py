"""Plans and their execution from Python, without the command."""

from __future__ import annotations

from pathlib import Path

import pytest

from stagewire.errors import LinkOpenError, StagewireError
from stagewire_conformance.device.errors import DeclarationError, NothingToRunError
from stagewire_conformance.device.execution import dead_line_report, execute, verify
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.reports import Grade, Verdict
from stagewire_conformance.reports.device_sheet import sheet_of_execution
from stagewire_conformance.reports.device_text import announcement, ending

URL = "virtual://TDC001"
ASKING = Permissions()


def test_a_run_has_a_verdict_and_an_exit_status(tmp_path: Path) -> None:
    plan = Plan.of("TDC001", ASKING, only=["identification"], seed=7)
    capture = tmp_path / "run.txt"
    execution = execute(URL, plan, log=capture)
    sheet = sheet_of_execution(execution)
    assert (sheet.verdict, sheet.exit_status) == (Verdict.PARTIAL, 0)
    assert (execution.interrupted, execution.capture) == (False, capture)
    assert "HW_REQ_INFO" in capture.read_text(encoding="utf-8")
    assert sheet.command == (
        "stagewire conformance device virtual://TDC001 --unit TDC001 --only identification --seed 7"
    )
    assert [*ending(execution.report)] == []
    (line,) = (fact for fact in sheet.facts if fact.key == "url")
    assert (line.label, line.value) == ("Line", URL)


def test_a_dead_line_gives_a_report(tmp_path: Path) -> None:
    plan = Plan.of("TDC001", ASKING)
    execution = execute(str(tmp_path / "no_port"), plan)
    sheet = sheet_of_execution(execution)
    assert (sheet.verdict, sheet.exit_status) == (Verdict.UNFINISHED, 4)
    assert "no_port" in execution.report.unfinished
    assert {case.grade for case in sheet.cases()} == {Grade.NOT_RUN}
    refused = next(case for case in sheet.cases() if "--allow-settings" in case.why)
    assert refused.why == "not allowed: needs --allow-settings"
    assert any(case.why == "nothing was run" for case in sheet.cases())


def test_the_report_of_a_dead_line_states_the_reason() -> None:
    plan = Plan.of("BBD102", ASKING, seed=3)
    report = dead_line_report(URL, plan, "the cable is not there")
    assert (report.unfinished, report.outcomes, report.seed) == ("the cable is not there", (), 3)
    assert [check for check, _ in report.not_run] == list(plan.checks)
    assert [*ending(report)] == []


def test_an_interruption_before_the_run_is_reported() -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    execution = execute(URL, Plan.of("TDC001", ASKING), progress=interrupt)  # type: ignore[arg-type]
    sheet = sheet_of_execution(execution)
    assert execution.interrupted
    assert sheet.unfinished == "interrupted before it began"
    assert (sheet.verdict, sheet.exit_status) == (Verdict.UNFINISHED, 130)


def test_a_plan_lists_effects_and_refusals() -> None:
    motion = Range.parse("0..100000counts")
    allowed = Permissions(settings=True, tuning=True, motion=motion)
    plan = Plan.of("TDC001", allowed)
    effects = plan.effects()
    assert list(effects) == [Need.SETTINGS, Need.TUNING, Need.MOTION]
    assert all(Need.MOTION in check.needs for check in effects[Need.MOTION])
    assert all(Need.MOTION not in check.needs for check in effects[Need.SETTINGS])
    assert not any("not allowed" in why for why in plan.refusals())
    asking = Plan.of("TDC001", ASKING)
    refused = [check for check in asking.checks if check.needs]
    assert sum(asking.refusals().values()) == len(refused) > 0
    assert "not allowed: needs --allow-settings" in asking.refusals()
    lines = [*announcement(URL, plan)]
    assert lines[0].startswith(f"TDC001 at {URL}: {len(plan.runnable)} checks, about ")
    assert any(
        line.startswith("This run moves stages or drives outputs within 0..100000counts")
        for line in lines
    )
    assert any(
        line.startswith("This run does not change settings") for line in announcement(URL, asking)
    )


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        (
            "KIM101",
            "KIM101 has channels 1 to 4; checks and findings use their numbers in messages: 1, 2, 4, 8",
        ),
        ("BSC203", ""),
    ],
)
def test_the_announcement_states_the_numbers_of_channels_in_messages(unit: str, said: str) -> None:
    lines = announcement(URL, Plan.of(unit, ASKING))
    assert [line for line in lines if "in messages" in line] == ([said] if said else [])


def test_a_plan_needs_a_declaration(tmp_path: Path) -> None:
    with pytest.raises(DeclarationError, match="give --unit"):
        Plan.of(None, ASKING)
    with pytest.raises(DeclarationError, match="needs a PICS that lists its bays"):
        Plan.of("rack", ASKING)
    with pytest.raises(StagewireError, match="unknown unit TDC999"):
        Plan.of("TDC999", ASKING)
    pics = tmp_path / "pics.toml"
    pics.write_text('schema_version = 1\nunit = "TDC001"\n', encoding="utf-8")
    assert Plan.of("tdc001", ASKING, pics=pics).declared.unit.name == "TDC001"
    with pytest.raises(DeclarationError, match="--unit BBD102 contradicts"):
        Plan.of("BBD102", ASKING, pics=pics)


def test_a_plan_without_checks_is_refused_before_the_line_is_opened(tmp_path: Path) -> None:
    every = Plan.of("TDC001", ASKING)
    needing = next(check.id for check in every.checks if check.needs == {Need.SETTINGS})
    plan = Plan.of("TDC001", ASKING, only=[needing])
    capture = tmp_path / "run.txt"
    with pytest.raises(NothingToRunError, match="all selected checks are omitted: not allowed"):
        execute(URL, plan, log=capture)
    assert not capture.exists()


def test_a_url_without_a_virtual_controller_is_refused() -> None:
    with pytest.raises(LinkOpenError):
        verify("virtual://TDC999", Plan.of("TDC001", ASKING))

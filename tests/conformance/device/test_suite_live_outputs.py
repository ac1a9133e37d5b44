"""Lasers and heaters: nothing is written to one that is on, and none is left on."""

from __future__ import annotations

from typing import Any

import pytest
from watched_links import ALL, WatchedLink, controller_of, lost, made, run_made

from stagewire_apt import messages as m
from stagewire_conformance.device.declaration import declare
from stagewire_conformance.device.permissions import Need, Permissions
from stagewire_conformance.device.plans import Plan, plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_conformance.device.trial import Trial
from stagewire_conformance.reports import Verdict
from stagewire_conformance.reports.device_sheet import sheet_of
from stagewire_conformance.reports.text import sentence
from stagewire_virtual import VirtualController
from stagewire_virtual.linking import SteppedLink

ON = m.LaEnableOutput().pack(0x50, 0x01)
OFF = m.LaDisableOutput().pack(0x50, 0x01)
LASERS = ("KLD101", "TLD001", "KLS101", "TLS001", "KLS1550")
WITH_LASER = frozenset({Need.LASER})


def output_of(controller: VirtualController) -> Any:
    instrument: Any = controller.instrument
    return instrument.channel(1).behaviour


def shining(unit: str) -> VirtualController:
    """Return a laser that was switched on before the run."""
    controller = controller_of(unit)
    controller.write(ON)
    controller.advance(5)
    controller.read()
    assert output_of(controller).on
    return controller


def heating() -> VirtualController:
    """Return a temperature controller whose output was switched on at its panel."""
    controller = controller_of("TTC001")
    output_of(controller).press_enable()
    assert output_of(controller).on
    return controller


@pytest.mark.parametrize("unit", [*LASERS, "TTC001"])
def test_nothing_is_written_to_an_output_that_is_on_when_the_run_begins(unit: str) -> None:
    controller = heating() if unit == "TTC001" else shining(unit)
    link, declared = WatchedLink(SteppedLink(controller)), declare(unit)
    checks = plan(declared, ALL)
    report = run(link, checks, declared, ALL, 1)
    assert output_of(controller).on
    needing = {check.id for check in checks if check.needs and not check.skip}
    assert needing
    assert needing <= {check.id for check, _ in report.not_run}
    assert report.adrift == (
        "the output of 0x50 was on when the run began, so the suite left it on and wrote no setting or "
        "output; switch it off and run the suite again",
    )
    why = {why for check, why in report.not_run if check.id in needing}
    assert why == {f"not reached: {report.unfinished}"}
    assert report.unfinished == report.adrift[0]
    assert OFF not in link.writes


@pytest.mark.parametrize("allowed", [ALL, Permissions()], ids=["all", "requests only"])
def test_an_output_that_is_on_when_the_run_begins_is_not_a_pass(allowed: Permissions) -> None:
    controller = shining("KLS1550")
    bench = Plan.of("KLS1550", allowed, only=["identification", "laser-output"])
    report = run(SteppedLink(controller), bench.checks, bench.declared, allowed, 1)
    made = sheet_of(report, bench.checks, 1.0, lambda only: "")
    assert (made.verdict, made.exit_status) == (Verdict.UNFINISHED, 4)
    assert not made.complete
    assert "0x50 was on when the run began, so the suite left it on" in sentence(made)


def switches_on(trial: Trial) -> None:
    trial.line.send_bytes(ON)
    trial.line.pause(5)


def laser_check(body: Any, unit: str = "KLD101") -> tuple[Report, VirtualController, WatchedLink]:
    controller = controller_of(unit)
    link = WatchedLink(SteppedLink(controller))
    check = made(body, needs=WITH_LASER)
    try:
        report = run_made(link, check, declared=declare(unit))
    except RunInterrupted as interrupted:
        report = interrupted.report
    return report, controller, link


def test_a_laser_that_a_check_leaves_on_is_reported_and_switched_off() -> None:
    report, controller, link = laser_check(switches_on)
    assert not output_of(controller).on
    assert link.writes[-1] != ON
    assert OFF in link.writes
    assert not report.adrift
    (outcome,) = report.outcomes
    assert outcome.result is Result.FAIL
    assert "the output of 0x50 is on, after a check that switches it off" in [
        finding.text for finding in outcome.findings
    ]


def interrupts(trial: Trial) -> None:
    trial.line.send(m.LaEnableOutput(), 0x50)
    trial.line.pause(5)
    raise KeyboardInterrupt


def breaks(trial: Trial) -> None:
    trial.line.send(m.LaEnableOutput(), 0x50)
    trial.line.pause(5)
    raise ValueError("a defect")


@pytest.mark.parametrize("body", [interrupts, breaks], ids=["ctrl-c", "a defect of the check"])
@pytest.mark.parametrize("unit", LASERS)
def test_an_interrupted_check_switches_the_laser_off_first(unit: str, body: Any) -> None:
    report, controller, link = laser_check(body, unit)
    assert not output_of(controller).on
    at = max(index for index, raw in enumerate(link.writes) if raw == ON)
    assert link.writes[at + 1 :].index(OFF) <= 30  # after requests of the status and keep-alives
    assert report.stops
    assert report.unfinished


def test_a_lost_line_reports_that_the_laser_may_be_on() -> None:
    def loses(trial: Trial) -> None:
        trial.line.send(m.LaEnableOutput(), 0x50)
        link.before_read = link.before_write = lambda *data: lost()

    controller = controller_of("KLD101")
    link = WatchedLink(SteppedLink(controller))
    report = run_made(link, made(loses, needs=WITH_LASER), declared=declare("KLD101"))
    assert "the line was lost" in report.unfinished
    assert any("may still be switched on" in text for text in report.adrift)


class _IgnoresOff(WatchedLink):
    """A line to a laser that ignores LA_DISABLEOUTPUT."""

    def write(self, data: bytes) -> None:
        if data != OFF:
            super().write(data)

    write_now = write


def test_a_laser_that_ignores_switching_off_is_not_reported_as_restored() -> None:
    found = Plan.of("KLD101", ALL, only=["laser-output"])
    link = _IgnoresOff(SteppedLink(controller_of("KLD101")))
    report = run(link, found.checks, found.declared, ALL, 1)
    (outcome,) = report.outcomes
    assert "the output of 0x50, off" not in outcome.restored
    texts = [finding.text for finding in outcome.findings]
    assert any(text.startswith("not restored: the output of 0x50, off") for text in texts)
    assert report.unfinished == "the output of 0x50 is still on after it was switched off"
    assert report.adrift == (report.unfinished,)

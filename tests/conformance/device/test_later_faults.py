"""Each fault of a controller of Issue 37 is found, and a finding names the rule that it breaks.

`make test` runs the kinds of checks that must find a fault, for some of the faults. `make test-all` does so
for all of them, and also runs the whole suite on some.
"""

from __future__ import annotations

from typing import Any

import pytest
from apt_runs import Bench, faulty_link
from later_benches import laboratory
from later_faults import LaterFault, LinkFault, byte, of
from later_faults_bytes import BYTES
from later_faults_generic import GENERIC
from later_faults_motion import MOTION

from parts import every_nth
from planted_faults import FAULTS, cases_of, rules_named
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run

EVERY = [(unit, fault) for fault in (*BYTES, *MOTION, *GENERIC) for unit in fault.units]
OWN = [case for case in EVERY if case[1] not in GENERIC]
BY_NAME = {fault.name: fault for _, fault in EVERY}
UNITS = sorted({unit for unit, _ in EVERY})
FAMILIES = (
    "KDC101", "KST101", "KST201", "K10CR1", "LTS150", "LTS300", "MLJ050", "BSC201", "BSC203", "KBD101",
    "TBD001", "BBD202", "BBD302", "MFF101", "MFF102", "KSC101",
    "KLD101", "TLD001", "KLS635", "TLS001", "TTC001", "KNA101", "TNA001", "KPA101", "TPA101",
)  # fmt: skip


_EXCHANGED = {0: 0, 1: 2, 2: 1, 3: 3}
"""The bits of both positions of a flipper -> the same bits exchanged."""


def run_with(on: Bench, fault: LinkFault, kinds: tuple[str, ...] = ()) -> Report:
    """Run the checks of some kinds, or the whole suite, on a controller with a fault."""
    allowed = on.allowed()
    checks = [
        check
        for check in plan(on.declared, allowed)
        if not kinds or (check.kind is not None and check.kind.name in kinds)
    ]
    report = run(faulty_link(on, fault), checks, on.declared, allowed, 1)
    assert report.defect is None, report.defect
    return report


def findings(report: Report) -> list[str]:
    wrong = (Result.FAIL, Result.NON_STRICT)
    return [
        finding.text
        for outcome in report.outcomes
        for finding in outcome.findings
        if finding.result in wrong
    ]


def named(case: Any) -> str | None:
    return case.name.replace(" ", "-") if isinstance(case, LaterFault) else None


def test_the_faults_cover_the_families() -> None:
    assert len(BY_NAME) == len(BYTES) + len(MOTION) + len(GENERIC) >= 80
    assert set(FAMILIES) <= set(UNITS)


@pytest.mark.parametrize(("unit", "fault"), every_nth(EVERY, 5), ids=named)
def test_a_fault_is_found_by_the_right_rule(unit: str, fault: LaterFault) -> None:
    report = run_with(laboratory(unit), fault.make(), fault.kinds)
    assert fault.rule in rules_named(report), findings(report)
    assert len(findings(report)) <= 3


@pytest.mark.parametrize(
    "mirrored",
    [
        LinkFault(to_controller=of("MOT_MOVE_JOG", lambda raw: byte(3, 3 - raw[3])(raw))),
        LinkFault(of("MOT_GET_STATUSBITS", lambda raw: byte(8, _EXCHANGED[raw[8] & 3])(raw))),
    ],
    ids=["jogs", "bits"],
)
def test_a_flipper_may_have_its_positions_the_other_way_round(mirrored: LinkFault) -> None:
    """Page 86 of Issue 37 leaves the direction of a jog to the device."""
    assert not findings(run_with(laboratory("MFF101"), mirrored, ("flipper", "flipper-time")))


@pytest.mark.matrix
@pytest.mark.parametrize(("unit", "fault"), OWN[::4], ids=named)
def test_the_whole_suite_names_the_rule(unit: str, fault: LaterFault) -> None:
    assert fault.rule in rules_named(run_with(laboratory(unit), fault.make()))


@pytest.mark.parametrize("unit", UNITS)
def test_the_controller_without_a_fault_passes_these_checks(unit: str) -> None:
    kinds = {kind for each, fault in EVERY if each == unit for kind in fault.kinds}
    assert not findings(run_with(laboratory(unit), LinkFault(), tuple(kinds)))


@pytest.mark.parametrize(("rule", "name"), cases_of("later"))
def test_a_planted_fault_breaks_the_rule(rule: str, name: str) -> None:
    """The test above runs the fault; this one keeps the list true."""
    assert BY_NAME[name].rule == rule
    assert name in FAULTS["later"].values()

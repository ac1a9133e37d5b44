"""After a motor or an axis has ignored a stop, the suite starts no motion that only a stop ends."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from corpus_benches import BENCHES
from corpus_faults import Fault
from corpus_faults_ms2000_motion import FAULTS as MS2000_FAULTS
from corpus_faults_tdc001_motion import FAULTS as TDC001_FAULTS
from corpus_lines import SteppedCorpusLink
from corpus_motor import HOME
from corpus_tdc001 import Tdc001

from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_ms2000 import messages as m

FAULTS: dict[str, Fault] = {fault.name: fault for fault in (*TDC001_FAULTS, *MS2000_FAULTS)}


class StopSpeedsUpHoming(Tdc001):
    """A stop of homing is reported only when the motor has run to its end."""

    def move_stop(self, mode: int) -> None:
        if self.axis.motion != HOME:
            super().move_stop(mode)
            return
        self.axis.stopping = True


def run_kinds(bench: str, make: type | None, kinds: Sequence[str]) -> tuple[Report, list[bytes]]:
    """Run some kinds of checks, and return the report and what was sent."""
    on = BENCHES[bench]
    sent: list[bytes] = []

    class Watched(SteppedCorpusLink):
        def write(self, data: bytes) -> None:
            sent.append(data)
            super().write(data)

        def write_now(self, data: bytes) -> None:
            sent.append(data)
            super().write_now(data)

    checks = [check for check in on.checks if check.kind and check.kind.name in kinds]
    return run(Watched(make or on.make), checks, on.declared, on.allowed, 1), sent


def failed(report: Report) -> list[tuple[str, str]]:
    """Return the check and the rule of each failure."""
    return [
        (outcome.check.id, finding.rule)
        for outcome in report.outcomes
        for finding in outcome.findings
        if finding.result is Result.FAIL
    ]


def not_run(report: Report) -> set[str]:
    """Return the checks that were not run because of a root cause."""
    return {each.check.id for each in report.outcomes if each.result is Result.NOT_RUN}


def test_no_motor_runs_after_homing_ignored_a_stop() -> None:
    fault = FAULTS["StopDoesNotEndHoming"]
    report, sent = run_kinds("tdc001", fault.make, ("home", "move-jog", "move-velocity", "limits"))
    assert failed(report) == [("home/0x50/1", "stop-any-move")]
    assert not_run(report) == {
        "move-jog/0x50/1/continuous",
        "move-velocity/0x50/1",
        "limits/0x50/1",
    }
    assert not [data for data in sent if data[:2] == bytes.fromhex("5704")]  # MOT_MOVE_VELOCITY


def test_a_stop_that_the_motor_reports_only_at_its_end_is_found() -> None:
    report, _ = run_kinds("tdc001", StopSpeedsUpHoming, ("home",))
    assert [rule for _, rule in failed(report)] == ["stop-any-move"]


@pytest.mark.parametrize("name", ["SingleStepRunsOn", "JogStepIgnored"])
def test_no_motor_jogs_after_a_jog_went_too_far(name: str) -> None:
    report, sent = run_kinds("tdc001", FAULTS[name].make, ("home", "move-jog", "profile"))
    assert failed(report) == [("move-jog/0x50/1", "jog-single-step")]
    others = {"move-jog/0x50/1/continuous", "move-jog/0x50/1/far", "profile/0x50/1/jogs"}
    assert not_run(report) == others
    assert len([data for data in sent if data[:2] == bytes.fromhex("6A04")]) == 1  # MOT_MOVE_JOG


def test_a_measured_jog_is_stopped_after_one_and_a_half_times_its_distance() -> None:
    report, _ = run_kinds("tdc001", FAULTS["SingleStepRunsOn"].make, ("home", "profile"))
    [outcome] = [each for each in report.outcomes if each.check.id == "profile/0x50/1/jogs"]
    assert any("did not end with MOT_MOVE_COMPLETED" in each.text for each in outcome.findings)
    assert len([each for each in outcome.entries if each.raw[:2] == bytes.fromhex("6A04")]) == 1


def test_no_axis_moves_at_a_vector_speed_after_it_ignored_a_stop() -> None:
    kinds = ("move-increment", "stop-start", "move-vector", "ramps")
    report, sent = run_kinds("ms2000", FAULTS["StopIgnored"].make, kinds)
    assert failed(report) == [("move-increment/X/after-a-stop", "stop-disables")]
    assert {"move-vector/X", "move-vector/X/sign", "ramps/X/vector"} <= not_run(report)
    assert not [data for data in sent if data[1:2] == b"^"]


def test_a_vector_speed_of_zero_ends_a_motion_that_ignores_stops() -> None:
    report, sent = run_kinds("ms2000", FAULTS["StopIgnored"].make, ("move-vector",))
    assert ("move-vector/X/sign", "stop-disables") in failed(report)
    assert not report.adrift
    assert sent.count(m.WriteVectorSpeed(0).pack(0x18)) > 0

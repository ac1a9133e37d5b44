"""Each fault planted in the second corpus is found, and named by a rule that it breaks.

`make test` runs a sample that is drawn by seed, `make test-all` all faults. A fault is a subclass of a
correct controller, described in ``corpus_faults_*.py``.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
from corpus_benches import BENCHES, CorpusBench
from corpus_faults import Fault
from corpus_faults_ms2000_bytes import FAULTS as MS2000_BYTES
from corpus_faults_ms2000_motion import FAULTS as MS2000_MOTION
from corpus_faults_stepper_bytes import FAULTS as STEPPER_BYTES
from corpus_faults_stepper_motion import FAULTS as STEPPER_MOTION
from corpus_faults_tdc001_bytes import FAULTS as TDC001_BYTES
from corpus_faults_tdc001_motion import FAULTS as TDC001_MOTION
from corpus_faults_tdc001_reports import FAULTS as TDC001_REPORTS
from corpus_faults_tdc001_settings import FAULTS as TDC001_SETTINGS

from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result

SAMPLE = 40
FAULTS = {
    "tdc001": (*TDC001_MOTION, *TDC001_REPORTS, *TDC001_BYTES, *TDC001_SETTINGS),
    "stepper": (*STEPPER_MOTION, *STEPPER_BYTES),
    "ms2000": (*MS2000_MOTION, *MS2000_BYTES),
}
EVERY = [(name, fault) for name, faults in FAULTS.items() for fault in faults]
WRONG = (Result.FAIL, Result.NON_STRICT)

NOT_FOUND_YET = {
    "CapIgnoredByAbsoluteMoves",
    "CapIgnoredByVelocityMoves",
    "ContinuousJogIgnored",
    "CounterNotUsedByMoves",
    "EndsTooFar",
    "ErrorAfterEveryMove",
    "HomeVelocityIgnored",
    "HomesAtMoveVelocity",
    "HomesOnPaper",
    "JogAccelerationIgnored",
    "JogHalfAsFast",
    "MoveAcknowledged",
    "MovesWhileDisabled",
    "ParameterNotZero",
    "PositionOfTheTarget",
    "SmallMovesNotCompleted",
    "StatusBitsOfTheLastUpdate",
    "StatusShowsTheTarget",
    "SuspendHidesOnlyCompleted",
    "TopSpeedDoubled",
    "UpdatesFrozenInMotion",
    "UpdatesPauseInMotion",
    "UpdatesToTheMotherboard",
    "VelocityAlwaysZero",
}
"""Faults that the suite does not find yet, or not by the right rule."""


def runs() -> Iterator[Any]:
    """Yield all faults; those outside the sample belong to the matrix."""
    sample = set(random.Random(24).sample(range(len(EVERY)), SAMPLE))
    for number, (name, fault) in enumerate(EVERY):
        marks = [] if number in sample else [pytest.mark.matrix]
        yield pytest.param(BENCHES[name], fault, id=f"{name}-{fault.name}", marks=marks)


def rules_named(report: Report) -> set[str]:
    """Return the rules that the findings of a report name.

    A finding that names no rule stands for all rules of its check.
    """
    return {
        rule
        for outcome in report.outcomes
        for finding in outcome.findings
        if finding.result in WRONG
        for rule in ([finding.rule] if finding.rule else outcome.check.rules)
    }


def test_there_are_enough_faults() -> None:
    names = [fault.name for _, fault in EVERY]
    assert len(set(names)) >= 120
    assert sum(fault.dynamic for _, fault in EVERY) >= 45
    assert all(fault.text.endswith(".") for _, fault in EVERY)
    assert len(set(EVERY)) == len(EVERY)


def test_the_list_of_faults_not_found_yet_is_current() -> None:
    assert {fault.name for _, fault in EVERY} >= NOT_FOUND_YET


@pytest.mark.parametrize(("bench", "fault"), list(runs()))
def test_a_fault_is_found(bench: CorpusBench, fault: Fault) -> None:
    report = bench.run(fault.make)
    assert report.defect is None, report.defect
    if fault.name in NOT_FOUND_YET:
        return
    named = rules_named(report)
    assert named & fault.rules, f"{fault.text} The findings name {sorted(named) or 'no rule'}."

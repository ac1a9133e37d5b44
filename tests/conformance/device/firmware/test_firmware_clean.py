"""A correct controller passes: every unit, with all permissions, with any seed."""

from __future__ import annotations

import pytest
from firmware_bench import BENCHES, bench

from parts import every_nth
from stagewire_conformance.device.results import Result

SEEDS = range(3)
RUNS = [(name, seed) for seed in SEEDS for name in BENCHES]


def test_there_are_enough_runs() -> None:
    assert len(RUNS) >= 100


@pytest.mark.parametrize(("name", "seed"), every_nth(RUNS, 7))
def test_a_correct_controller_passes(name: str, seed: int) -> None:
    unit = bench(name)
    report = unit.run(unit.line(seed), seed=seed)
    assert not report.unfinished, report.unfinished
    wrong = {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in report.outcomes
        if outcome.result in (Result.FAIL, Result.NON_STRICT)
    }
    assert not wrong
    assert any(outcome.result is Result.PASS for outcome in report.outcomes)

"""Each fault planted in the second corpus has one finding, which names a rule that it breaks.

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
from corpus_firmware import EVERY

import stagewire_apt
import stagewire_ms2000
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result

SAMPLE = 40
WRONG = (Result.FAIL, Result.NON_STRICT)


def runs() -> Iterator[Any]:
    """Yield all faults; those outside the sample belong to the matrix."""
    sample = set(random.Random(24).sample(range(len(EVERY)), SAMPLE))
    for number, (name, fault) in enumerate(EVERY):
        marks = [] if number in sample else [pytest.mark.matrix]
        yield pytest.param(BENCHES[name], fault, id=f"{name}-{fault.name}", marks=marks)


def rules_named(report: Report) -> list[set[str]]:
    """Return the rules that each finding names; those of its check if it names none."""
    return [
        {finding.rule} if finding.rule else set(outcome.check.rules)
        for outcome in report.outcomes
        for finding in outcome.findings
        if finding.result in WRONG
    ]


def test_there_are_enough_faults() -> None:
    names = [fault.name for _, fault in EVERY]
    assert len(set(names)) >= 120
    assert sum(fault.dynamic for _, fault in EVERY) >= 45
    assert all(fault.text.endswith(".") for _, fault in EVERY)
    assert len(set(EVERY)) == len(EVERY)


@pytest.mark.parametrize(("bench", "fault"), list(runs()))
def test_a_fault_has_one_finding_that_names_its_rule(bench: CorpusBench, fault: Fault) -> None:
    report = bench.run(fault.make)
    assert report.defect is None, report.defect
    named = rules_named(report)
    assert any(rules & fault.rules for rules in named), f"{fault.text} The findings name {named}."
    assert len(named) == 1, f"{fault.text} One cause has {len(named)} findings."


def test_the_rules_of_faults_exist() -> None:
    known = {
        rule["id"]
        for protocol in (stagewire_apt.PROTOCOL, stagewire_ms2000.PROTOCOL)
        for rule in protocol.registry()["rules"]
    }
    assert {rule for _, fault in EVERY for rule in fault.rules} <= known

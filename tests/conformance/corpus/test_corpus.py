"""The second corpus: firmware written from the documents alone, without and with planted faults.

A correct controller passes on the stepped clock and in real time.
"""

from __future__ import annotations

import pytest
from corpus_benches import BENCHES
from corpus_lines import RealTimeCorpusLink, SteppedCorpusLink

from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result

REAL_TIME = pytest.param(RealTimeCorpusLink, id="real-time", marks=pytest.mark.matrix)
WRONG = (Result.FAIL, Result.NON_STRICT)


def findings(report: Report) -> dict[str, list[str]]:
    """Return what a report finds wrong, by check."""
    assert report.defect is None, report.defect
    assert not report.unfinished, report.unfinished
    return {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in report.outcomes
        if outcome.result in WRONG
    }


@pytest.mark.parametrize("line", [pytest.param(SteppedCorpusLink, id="stepped"), REAL_TIME])
@pytest.mark.parametrize("name", BENCHES)
def test_a_correct_controller_passes(name: str, line: type) -> None:
    report = BENCHES[name].run(line=line)
    assert not findings(report)
    results = [outcome.result for outcome in report.outcomes]
    assert results.count(Result.PASS) >= 0.95 * len(results)

"""The C testees pass the conformance suite for codecs, as processes that read and write lines."""

from __future__ import annotations

import pytest
from testees import PROTOCOLS, Testees

from stagewire.protocols import load_protocol
from stagewire_conformance.testees import run

pytestmark = pytest.mark.matrix

PATIENT = 60.0
"""Timeout of an answer in seconds: more than any machine needs."""


@pytest.mark.parametrize("name", PROTOCOLS.values())
def test_everything_passes(name: str, testees: Testees) -> None:
    command = [str(word) for word in testees.program(name).words]
    report = run(command, [load_protocol(name)], timeout=PATIENT)
    assert [(result.case.id, result.text) for result in report.failures()] == []
    assert (report.counts().keys(), report.starts, report.unfinished) == ({"passed"}, 1, "")
    assert len(report.results) > 1500

"""The planted faults that break the rules of checks: ``tests/conformance/planted_faults.yaml``."""

from __future__ import annotations

from typing import Any

import yaml

from checkout import ROOT
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result

WITHOUT = "without_a_fault"
"""The group of rules that no planted fault breaks, with the reasons."""

FAULTS: dict[str, Any] = yaml.safe_load(
    (ROOT / "tests" / "conformance" / "planted_faults.yaml").read_text(encoding="utf-8")
)
"""The faults by group and rule."""


def cases_of(*groups: str) -> list[tuple[str, Any]]:
    """Return the rules of some groups, each with its fault."""
    return [case for group in groups for case in FAULTS[group].items()]


def rules_named(report: Report) -> set[str]:
    """Return the rules that the findings of a report name."""
    return {
        finding.rule
        for outcome in report.outcomes
        for finding in outcome.findings
        if finding.result in (Result.FAIL, Result.NON_STRICT)
    }

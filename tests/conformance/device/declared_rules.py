"""The rules that findings name, compared with those that their checks declare."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire_conformance.device.checks.apt import broken_rules as apt
from stagewire_conformance.device.checks.ms2000 import broken_rules as ms2000
from stagewire_conformance.device.report import Outcome
from stagewire_conformance.device.results import Result
from stagewire_conformance.registry import known_rules

COMMON = {"thorlabs_apt": frozenset(apt.COMMON), "asi_ms2000": frozenset(ms2000.COMMON)}

WITHOUT_A_RULE = (
    "not restored: ",  # the check could not undo its changes
    "left as it is, ",
    "the PICS promises",  # a promise of the vendor, not a rule of the document
    "the check could not continue: ",
    "ignored its stops",  # the suite brought it to rest after the check
    "came to rest only when it was disabled",
    "did not come to rest",
)
"""Parts of the findings that break no rule of a document."""


def wrongly_named(protocol: str, outcomes: Iterable[Outcome]) -> list[str]:
    """Return the findings without a rule, and those with a rule that their check does not declare."""
    found = []
    for outcome in outcomes:
        declared = {*outcome.check.rules, *COMMON[protocol]}
        for finding in outcome.findings:
            if finding.result not in (Result.FAIL, Result.NON_STRICT):
                continue
            excused = any(part in finding.text for part in WITHOUT_A_RULE)
            if (finding.rule and finding.rule not in declared) or not (finding.rule or excused):
                found.append(f"{outcome.check.id}: {finding.rule or 'no rule'}: {finding.text}")
    return found


def unknown_common_rules(protocol: str, registry: object) -> set[str]:
    """Return the common rules that the registry does not have."""
    return set(COMMON[protocol] - known_rules(registry).keys())  # type: ignore[arg-type]

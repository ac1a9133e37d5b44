"""What a run was allowed to do, and what came of none of the checks that need it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_conformance.device.check import Check, Need
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result

__all__ = ["missed"]

_DECIDED = (Result.PASS, Result.NON_STRICT, Result.FAIL)

_WHAT = {
    Need.SETTINGS: "no check that changes settings",
    Need.MOTION: "no check that moves",
    Need.EEPROM: "no check that writes the EEPROM",
}


def missed(report: Report, checks: Sequence[Check]) -> Iterator[str]:
    """Yield a clause for each permission of which no check could make use, with the first reason.

    :param checks: all that were planned, in order.

    Of a run that was cut short there is nothing to tell but that.
    """
    if report.unfinished:
        return
    outcomes = {outcome.check.id: outcome for outcome in report.outcomes}
    left_out = {check.id: why for check, why in report.not_run}
    for need in Need:
        needing = [check for check in checks if need in check.needs]
        ran = [outcomes[check.id] for check in needing if check.id in outcomes]
        if need not in report.allowed.granted or not needing:
            continue
        if any(outcome.result in _DECIDED for outcome in ran):
            continue
        said = [finding.text for outcome in ran for finding in outcome.findings]
        reasons = [*said, *(left_out.get(check.id) or check.skip for check in needing)]
        why = next(filter(None, reasons), "nothing says why")
        yield f"{_WHAT[need]} came to a result: {why}"

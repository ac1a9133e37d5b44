"""Plans and early ends of runs against controllers, as lines of plain text.

Texts of controllers and of callers are in them as they are: escape what is printed on a terminal.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.check import Check
from stagewire_conformance.device.permissions import Need
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.reports.device_sheet import places
from stagewire_conformance.reports.text import counted, where

_EFFECTS: Final = {
    Need.SETTINGS: "changes settings, and restores them",
    Need.MOTION: "moves, or switches what is put out",
    Need.EEPROM: "writes the EEPROM",
}


def announcement(url: str, plan: Plan) -> Iterator[str]:
    """Yield the lines to show before a run: what is tested, what is done to it, and what is left out."""
    yield (
        f"{plan.declared.unit.name} at {url}: {counted(len(plan.runnable), 'check')}, "
        f"about {max(1, round(plan.seconds))} s; seed {plan.seed}"
    )
    effects = plan.effects()
    if not effects:
        yield "It is only asked: nothing is set, written or moved."
    for need, checks in effects.items():
        bound = f" within {plan.allowed.motion}" if need is Need.MOTION else ""
        yield f"It {_EFFECTS[need]}{bound}: {counted(len(checks), 'check')}"
        for text in dict.fromkeys(check.does for check in checks if check.does):
            yield f"  {text}"
    for why, number in plan.refusals().items():
        yield f"Not run: {counted(number, 'check')}: {why}"


def needs_text(check: Check) -> str:
    """Return the permissions that a check needs, such as ``settings, motion``."""
    return ", ".join(need for need in Need if need in check.needs)


def pages_text(plan: Plan, check: Check) -> str:
    """Return the pages of the document about the messages of a check, or else about its rules."""
    registry = plan.declared.registry
    found = {page for name in check.messages for page in registry.messages[name]["pages"]}
    if not found:
        rules = {rule["id"]: rule["page"] for rule in registry.data["rules"]}
        found = {rules[name] for name in check.held_to if name in rules}
    return where(places(registry, sorted(found)))


def ending(report: Report) -> Iterator[str]:
    """Yield the lines about a run that ended early, apart from the reason why it did.

    They name the stops that were sent, and the restored settings and the findings of its last check.
    """
    for text in report.stops:
        yield f"stop was sent: {text}"
    for last in report.outcomes[-1:]:
        for text in last.restored:
            yield f"restored: {text}"
        for finding in last.findings:
            yield f"{last.check.id}: {finding.text}"

"""Plain text about the plan of a run against a controller, and about its early end.

It contains unescaped texts from controllers and callers: escape it before printing it on a terminal.
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
    Need.TUNING: "changes control loops and motor currents, and restores them",
    Need.MOTION: "moves stages or drives outputs",
    Need.EEPROM: "writes to the EEPROM",
    Need.LASER: "switches lasers on and changes their light",
    Need.HEATER: "changes the current of heaters and coolers",
    Need.SHUTTER: "opens shutters",
    Need.PIEZO: "changes the output voltages of piezo drivers",
    Need.ZERO: "lets piezo actuators move through their whole range to find the zero",
    Need.INERTIAL: "changes the drive voltages of inertial motors",
}


def announcement(url: str, plan: Plan) -> Iterator[str]:
    """Yield the lines to print before a run: the controller, the effects, and the omitted checks."""
    yield (
        f"{plan.declared.unit.name} at {url}: {counted(len(plan.runnable), 'check')}, "
        f"about {max(1, round(plan.seconds))} s; seed {plan.seed}"
    )
    yield from _channel_numbers(plan)
    effects = plan.effects()
    if not effects:
        yield "This run does not change settings, write to memory or move anything."
    for need, checks in effects.items():
        within = plan.allowed.motion and need in (Need.MOTION, Need.PIEZO)
        bound = f" within {plan.allowed.motion}" if within else ""
        yield f"This run {_EFFECTS[need]}{bound}: {counted(len(checks), 'check')}"
        for text in dict.fromkeys(_effect_text(check) for check in checks if check.does):
            yield f"  {text}"
    for why, number in plan.refusals().items():
        yield f"Not run: {counted(number, 'check')} ({why})"


def _channel_numbers(plan: Plan) -> Iterator[str]:
    """Yield the numbers that findings use for channels, for units whose messages do not count from 1."""
    for unit in dict.fromkeys(place.unit for place in plan.declared.places):
        count, idents = unit.channels, unit.channel_idents
        if idents != tuple(range(1, count + 1)):
            yield (
                f"{unit.name} has channels 1 to {count}; checks and findings use their numbers in messages: "
                f"{', '.join(map(str, idents))}"
            )


def _effect_text(check: Check) -> str:
    """Return what a check does, with the bound of each of its motions."""
    return f"{check.does} ({check.bound})" if check.bound else check.does


def needs_text(check: Check) -> str:
    """Return the permissions that a check needs, such as ``settings, motion``."""
    return ", ".join(need for need in Need if need in check.needs)


def pages_text(plan: Plan, check: Check) -> str:
    """Return the pages of the document about the messages of a check, or otherwise about its rules."""
    registry = plan.declared.registry
    messages = (registry.messages[name] for name in check.messages)
    found = {(page, registry.overlay_of(entry)) for entry in messages for page in entry["pages"]}
    if not found:
        rules = {rule["id"]: rule for rule in registry.data["rules"]}
        named = (rules[name] for name in check.rules if name in rules)
        found = {(rule["page"], registry.overlay_of(rule)) for rule in named}
    return where(
        sorted(place for page, overlay in found for place in places(registry, (page,), overlay))
    )


def ending(report: Report) -> Iterator[str]:
    """Yield lines about a run that ended early, without the reason.

    They list the stops that were sent, and the restored settings and findings of the last check.
    """
    for text in report.stops:
        yield f"stop sent: {text}"
    for last in report.outcomes[-1:]:
        for text in last.restored:
            yield f"restored: {text}"
        for finding in last.findings:
            yield f"{last.check.id}: {finding.text}"

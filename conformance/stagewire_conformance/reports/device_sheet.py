"""The sheet of a run of checks against a controller.

It begins with the identity of the controller, the declared features and the permissions, and names
permissions that no check used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.execution import Execution
from stagewire_conformance.device.permissions import Need
from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.targets import Target
from stagewire_conformance.registry import Registry
from stagewire_conformance.reports.model import (
    Case,
    Erratum,
    Fact,
    Finding,
    Grade,
    Group,
    Message,
    Omission,
    PageReference,
    Rule,
    Sheet,
    Transmission,
)
from stagewire_conformance.reports.pics_facts import certificate_facts, pics_facts


def facts(report: Report) -> tuple[Fact, ...]:
    """Return the facts of a run, in the order of the report."""
    return tuple(_facts(report))


_ALLOWED = {
    Need.EEPROM: "write to the EEPROM",
    Need.LASER: "switch lasers on",
    Need.HEATER: "change the current of heaters and coolers",
    Need.SHUTTER: "open shutters",
    Need.PIEZO: "change output voltages of piezo drivers",
    Need.ZERO: "zero piezo actuators",
    Need.INERTIAL: "change drive voltages of inertial motors",
}


def allowed_words(report: Report) -> str:
    """Return a description of what the run was allowed to do."""
    allowed = report.allowed
    more = [
        *(["change settings, and restore them"] if allowed.settings else []),
        *(["change control loops, and restore them"] if allowed.tuning else []),
        *([f"move within {allowed.motion}"] if allowed.motion else []),
        *(words for need, words in _ALLOWED.items() if need in allowed.granted),
    ]
    return (
        "; ".join(["send requests and faulty frames", *more])
        if more
        else "only send requests and faulty frames"
    )


def _facts(report: Report) -> Iterator[Fact]:
    declared = report.declared
    yield from certificate_facts(declared.pics)
    yield Fact(key="unit", label="Unit", value=declared.unit.name)
    if declared.unit.title:
        yield Fact(key="unit_title", label="Description", value=declared.unit.title)
    yield Fact(key="url", label="Line", value=report.url)
    for name, value in report.identification.items():
        said = f"Reported {name.replace('_', ' ')}"
        yield Fact(key=f"identification_{name}", label=said, value=value)
    yield Fact(key="declared_by", label="Declaration", value=_declared_by(declared))
    yield Fact(key="issue", label="Issue of the document", value=declared.issue)
    if not declared.pics.motherboard:
        yield Fact(key="motherboard", label="Motherboard", value="none, as the PICS declares")
    for place in declared.places:
        yield Fact(key=f"place_{place.name}", label=f"At {place.name}", value=_place(place))
    yield Fact(key="line", label="Line type", value=declared.pics.line)
    if declared.firmware:
        yield Fact(key="firmware", label="Firmware", value=declared.firmware)
    yield Fact(key="allowed", label="Allowed", value=allowed_words(report))
    yield Fact(
        key="jitter_ms", label="Jitter of this computer, ms", value=round(report.jitter * 1e3, 3)
    )


def _declared_by(declared: Declaration) -> str:
    return "PICS" if declared.pics.digest else "no PICS; the unit is assumed to be as documented"


def _place(place: Target) -> str:
    """Return a description of the controller at an address or axis."""
    if place.is_motherboard:
        return "motherboard"
    controllers = {each.scales.controller for each in place.fitted.values()} - {place.unit.name}
    parts = [
        place.unit.name,
        *(f"identified as {controller}" for controller in sorted(controllers)),
    ]
    for channel, fitted in place.fitted.items():
        name = "" if channel is None else f"channel {channel}: "
        stage = fitted.stage.name if fitted.stage else "no stage declared, counts only"
        travel = f", travel {fitted.travel} counts" if fitted.travel else ""
        parts.append(f"{name}{stage}{travel}")
    return "; ".join(parts)


_DECIDED = (Result.PASS, Result.FRAGILE, Result.NON_STRICT, Result.FAIL)

_WHAT = {
    Need.SETTINGS: "no check that changes settings",
    Need.TUNING: "no check that changes control loops",
    Need.MOTION: "no check that moves",
    Need.EEPROM: "no check that writes to the EEPROM",
    Need.LASER: "no check that switches a laser on",
    Need.HEATER: "no check that changes the current of a heater",
    Need.SHUTTER: "no check that opens a shutter",
    Need.PIEZO: "no check that changes a piezo voltage",
    Need.ZERO: "no check that zeroes an actuator",
    Need.INERTIAL: "no check that changes a drive voltage",
}


def missed(report: Report, checks: Sequence[Check]) -> Iterator[str]:
    """Yield a clause for each permission that no check used, with the first reason, and one for all others.

    :param checks: all planned checks, in order.

    Yields nothing for a run that did not finish.
    """
    if report.unfinished:
        return
    outcomes = {outcome.check.id: outcome for outcome in report.outcomes}
    left_out = {check.id: why for check, why in report.not_run}
    unneeded = []
    for need in Need:
        needing = [check for check in checks if need in check.needs]
        ran = [outcomes[check.id] for check in needing if check.id in outcomes]
        if need not in report.allowed.granted:
            continue
        if not needing:
            unneeded.append(str(need))
            continue
        if any(outcome.result in _DECIDED for outcome in ran):
            continue
        said = [finding.text for outcome in ran for finding in outcome.findings]
        reasons = [*said, *(left_out.get(check.id) or check.skip for check in needing)]
        reasons += [
            f"root cause: {cause}, reported by {first}"
            for outcome in ran
            for first, cause in outcome.met.items()
        ]
        why = next(filter(None, reasons), "none was selected")
        yield f"{_WHAT[need]} produced a result: {why}"
    if unneeded:
        yield f"allowed, but needed by no check of this run: {', '.join(unneeded)}"


GRADES = {
    Result.PASS: Grade.PASSED,
    Result.NON_STRICT: Grade.DEVIATES,
    Result.FRAGILE: Grade.FRAGILE,
    Result.FAIL: Grade.FAILED,
    Result.INFO: Grade.NOTED,
    Result.SKIP: Grade.SKIPPED,
    Result.NOT_RUN: Grade.NOT_RUN,
}

_NOT_RUN = "NOT RUN"
_NOT_REACHED = "the run ended before this check"


def sheet_of(
    report: Report,
    checks: Sequence[Check],
    seconds: float,
    again: Callable[[str], str],
    *,
    unselected: int = 0,
) -> Sheet:
    """Return the sheet of a run.

    :param checks: all planned checks, in order.
    :param seconds: the duration.
    :param again: returns the command that repeats a check by its id, or the whole run for an empty id.
    :param unselected: the number of checks that were not selected.
    """
    declared = report.declared
    registry = declared.registry
    listed = frozenset[str]().union(*(place.listed for place in declared.places))
    return Sheet(
        kind="device",
        title=f"Conformance of the {declared.unit.name}",
        protocols={declared.protocol.name: _document(registry, declared.unit.name)},
        started=report.started,
        seconds=seconds,
        seed=report.seed,
        facts=facts(report),
        declaration=pics_facts(declared.pics),
        digests={name: digest for name, digest in report.digests.items() if digest},
        command=again(""),
        groups=tuple(_groups(report, checks, again)),
        unfinished=report.unfinished,
        adrift=report.adrift,
        rules={rule.id: rule for rule in _rules(registry, listed)},
        errata={erratum.id: erratum for erratum in _errata(registry, listed)},
        messages=tuple(
            Message(
                name=name,
                places=places(registry, entry["pages"], registry.overlay_of(entry)),
                errata=tuple(entry["errata"]),
                unsupported=declared.unsupported.get(name, ""),
            )
            for name, entry in registry.messages.items()
            if name in listed
        ),
        unselected=unselected,
        missed=tuple(missed(report, checks)),
    )


def sheet_of_execution(execution: Execution) -> Sheet:
    """Return the sheet of a run that :func:`.execute` made, with its verdict and its exit status."""
    plan = execution.plan
    sheet = sheet_of(
        execution.report,
        plan.checks,
        execution.seconds,
        lambda only: plan.repeat(execution.url, only),
        unselected=plan.unselected,
    )
    return replace(sheet, interrupted=execution.interrupted)


def places(
    registry: Registry, pages: Iterable[int], overlay: str = ""
) -> tuple[PageReference, ...]:
    """Return pages or sections of a document, with their names.

    :param overlay: the overlay whose document has these pages; empty for that of the protocol.
    """
    protocol = registry.data["protocol"]
    return tuple(PageReference(protocol, page, registry.where((page,), overlay)) for page in pages)


def _document(registry: Registry, unit: str) -> str:
    """Return the document that describes the unit."""
    [entry] = [entry for entry in registry.data["units"] if entry["name"] == unit]
    document = registry.document(registry.overlay_of(entry))
    return f"{document['title']}, issue {document['issue']}"


def _groups(
    report: Report, checks: Sequence[Check], again: Callable[[str], str]
) -> Iterator[Group]:
    outcomes = {outcome.check.id: outcome for outcome in report.outcomes}
    left_out = {check.id: why for check, why in report.not_run}
    known = {rule["id"]: rule for rule in report.declared.registry.data["rules"]}
    kinds: dict[str, list[Check]] = {}
    for check in checks:
        assert check.kind is not None  # set when it was planned
        kinds.setdefault(check.kind.name, []).append(check)
    for name, of_kind in kinds.items():
        cases = (
            _case(
                check,
                _held_to(check, known),
                outcomes.get(check.id),
                left_out.get(check.id, _NOT_REACHED),
                _omission(check, report, left_out.get(check.id, "")),
                again,
            )
            for check in of_kind
        )
        kind = of_kind[0].kind
        yield Group(name=name, title=kind.title if kind else name, cases=tuple(cases))


def _held_to(check: Check, known: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Return the rules of a check; those about its own messages first."""
    own = frozenset(check.messages)
    return tuple(
        sorted(
            check.rules, key=lambda name: own.isdisjoint(known.get(name, {}).get("messages", ()))
        )
    )


def _omission(check: Check, report: Report, why: str) -> Omission:
    """Return the kind of the reason why a check was not run."""
    if check.needs - report.allowed.granted:
        return Omission.PERMISSION
    if check.lacks:
        return Omission.IMPOSSIBLE
    return (
        Omission.CAUSE
        if why and not why.startswith(("not reached", "nothing was run"))
        else Omission.ENDED
    )


def _case(
    check: Check,
    rules: tuple[str, ...],
    outcome: Outcome | None,
    why: str,
    omission: Omission,
    again: Callable[[str], str],
) -> Case:
    """Return the case of a check; ``why`` is the reason if it was not run, of the kind ``omission``."""
    if outcome is None:
        return Case(
            id=check.id,
            title=check.title,
            grade=Grade.NOT_RUN,
            word=_NOT_RUN,
            why=why,
            omission=omission,
            messages=check.messages,
            rules=rules,
        )
    return Case(
        id=check.id,
        title=check.title,
        grade=GRADES[outcome.result],
        word=str(outcome.result),
        why=check.skip or _root_causes(outcome),
        omission=Omission.CAUSE,
        causes=tuple(outcome.met),
        findings=tuple(
            Finding(
                grade=GRADES[found.result],
                text=found.text,
                wanted=found.wanted,
                came=found.came,
                rule=found.rule,
            )
            for found in outcome.findings
        ),
        lines=tuple(
            Transmission(
                time=entry.time,
                sent=entry.sent,
                raw=entry.raw,
                text=entry.text,
                minor=entry.keep_alive,
            )
            for entry in outcome.entries
        ),
        messages=check.messages,
        rules=rules,
        figures=outcome.figures,
        restored=outcome.restored,
        repeat=again(check.id),
        seconds=outcome.seconds,
    )


def _root_causes(outcome: Outcome) -> str:
    """Return why a check could not decide: the defects that it met, and the checks that report them."""
    if outcome.result is not Result.NOT_RUN:
        return ""
    return "; ".join(
        f"root cause: {what}, reported by {check}" for check, what in outcome.met.items()
    )


def _rules(registry: Registry, listed: frozenset[str]) -> Iterator[Rule]:
    """Yield the rules that can concern a unit with these messages, in the order of the documents."""
    found = [rule for rule in registry.data["rules"] if _concerns(rule, listed)]
    for rule in sorted(found, key=registry.order):
        (place,) = places(registry, (rule["page"],), registry.overlay_of(rule))
        yield Rule(
            id=rule["id"],
            place=place,
            strength=rule["strength"],
            states=rule["states"],
            means=rule.get("means") or "",
            errata=tuple(rule.get("errata") or ()),
            waiver=rule.get("waiver") or "",
            for_host=rule["subject"] == "host",
        )


def _concerns(entry: Mapping[str, Any], listed: frozenset[str]) -> bool:
    """Return whether an entry is about one of the listed messages, or about no message in particular."""
    names = entry.get("messages") or ()
    return not names or not listed.isdisjoint(names)


def _errata(registry: Registry, listed: frozenset[str]) -> Iterator[Erratum]:
    """Yield the errata of the messages and rules of a unit."""
    named = {name for entry in registry.messages.values() if entry["name"] in listed
             for name in entry["errata"]}  # fmt: skip
    named |= {name for rule in _rules(registry, listed) for name in rule.errata}
    for name, entry in registry.table("errata").items():
        if name in named:
            yield Erratum(
                id=name,
                places=places(registry, entry["pages"], registry.overlay_of(entry)),
                subject=entry["subject"],
                printed=entry["printed"],
                encoded=entry["encoded"],
                evidence=entry["evidence"],
            )

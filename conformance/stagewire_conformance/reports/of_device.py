"""The sheet of a run of checks against a controller."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from stagewire_conformance.device.check import Check
from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.registry import Registry
from stagewire_conformance.reports.facts import facts
from stagewire_conformance.reports.missed import missed
from stagewire_conformance.reports.model import (
    Case,
    Erratum,
    Finding,
    Grade,
    Group,
    Line,
    Message,
    Place,
    Rule,
    Sheet,
)

__all__ = ["GRADES", "sheet_of"]

GRADES = {
    Result.PASS: Grade.PASSED,
    Result.NON_STRICT: Grade.DEVIATES,
    Result.FAIL: Grade.FAILED,
    Result.INFO: Grade.NOTED,
    Result.SKIP: Grade.SKIPPED,
}

_NOT_RUN = "NOT RUN"
_NOT_REACHED = "the run ended before it came to this check"


def sheet_of(
    report: Report,
    checks: Sequence[Check],
    seconds: float,
    again: Callable[[str], str],
    *,
    whole: bool = True,
) -> Sheet:
    """Return what a run says, ready to be written.

    :param checks: all that were planned, in order.
    :param seconds: how long it all took.
    :param again: gives the command that runs a check again, by its id; the whole run for an empty one.
    :param whole: whether all checks were asked for, not only some.
    """
    declared = report.declared
    registry = declared.registry
    listed = frozenset[str]().union(*(place.listed for place in declared.places))
    return Sheet(
        kind="device",
        title=f"Conformance of the {declared.unit.name}",
        protocols={declared.protocol.name: _document(registry)},
        started=report.started,
        seconds=seconds,
        seed=report.seed,
        facts=facts(report),
        digests={name: digest for name, digest in report.digests.items() if digest},
        command=again(""),
        groups=tuple(_groups(report, checks, again)),
        unfinished=report.unfinished,
        rules={rule.id: rule for rule in _rules(registry, listed)},
        errata={erratum.id: erratum for erratum in _errata(registry, listed)},
        messages=tuple(
            Message(
                name=name,
                places=places(registry, entry["pages"]),
                errata=tuple(entry["errata"]),
                unsupported=declared.unsupported.get(name, ""),
            )
            for name, entry in registry.messages.items()
            if name in listed
        ),
        whole=whole,
        missed=tuple(missed(report, checks)),
    )


def places(registry: Registry, pages: Iterable[int]) -> tuple[Place, ...]:
    """Return pages or sections of the document, with their names."""
    protocol = registry.data["protocol"]
    return tuple(Place(protocol, page, registry.where((page,))) for page in pages)


def _document(registry: Registry) -> str:
    document = registry.document()
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
            check.held_to, key=lambda name: own.isdisjoint(known.get(name, {}).get("messages", ()))
        )
    )


def _case(
    check: Check,
    rules: tuple[str, ...],
    outcome: Outcome | None,
    why: str,
    again: Callable[[str], str],
) -> Case:
    """Return the case of a check; ``why`` it was not run, if there is no outcome."""
    if outcome is None:
        return Case(
            id=check.id,
            title=check.title,
            grade=Grade.NOT_RUN,
            word=_NOT_RUN,
            why=why,
            messages=check.messages,
            rules=rules,
        )
    return Case(
        id=check.id,
        title=check.title,
        grade=GRADES[outcome.result],
        word=str(outcome.result),
        why=check.skip,
        findings=tuple(
            Finding(
                grade=GRADES[found.result], text=found.text, wanted=found.wanted, came=found.came
            )
            for found in outcome.findings
        ),
        lines=tuple(
            Line(
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


def _rules(registry: Registry, listed: frozenset[str]) -> Iterator[Rule]:
    """Yield the rules that can concern a unit with these messages, in the order of the document."""
    found = [rule for rule in registry.data["rules"] if _concerns(rule, listed)]
    for rule in sorted(found, key=lambda rule: rule["page"]):
        (place,) = places(registry, (rule["page"],))
        yield Rule(
            id=rule["id"],
            place=place,
            strength=rule["strength"],
            says=rule["says"],
            means=rule.get("means") or "",
            errata=tuple(rule.get("errata") or ()),
            waiver=rule.get("waiver") or "",
            for_host=rule["subject"] == "host",
        )


def _concerns(entry: Mapping[str, Any], listed: frozenset[str]) -> bool:
    """Return whether what names messages, or none, is about any of those that are listed."""
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
                places=places(registry, entry["pages"]),
                subject=entry["subject"],
                printed=entry["printed"],
                encoded=entry["encoded"],
                evidence=entry["evidence"],
            )

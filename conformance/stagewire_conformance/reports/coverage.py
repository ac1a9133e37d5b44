"""The coverage of a run: by message, and by page of the document with its rules."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from stagewire_conformance.reports.model import Case, Grade, Message, PageReference, Rule, Sheet


@dataclass(frozen=True, kw_only=True)
class _Row:
    """The coverage of one item.

    :param counts: the number of cases about it, by grade.
    """

    counts: Counter[Grade]

    @property
    def grade(self) -> Grade | None:
        """The worst grade of its cases; None without cases."""
        return next((grade for grade in Grade if self.counts[grade]), None)


@dataclass(frozen=True, kw_only=True)
class MessageRow(_Row):
    """The coverage of a message."""

    message: Message


@dataclass(frozen=True, kw_only=True)
class RuleRow(_Row):
    """The coverage of a rule."""

    rule: Rule


@dataclass(frozen=True, kw_only=True)
class PageRow(_Row):
    """The coverage of a page of a document.

    :param rules: the rules on this page.
    :param messages: the messages described on this page.
    """

    place: PageReference
    rules: tuple[RuleRow, ...]
    messages: tuple[str, ...]


def messages(sheet: Sheet) -> list[MessageRow]:
    """Return a row for each message, in the order of the sheet."""
    counts: dict[str, Counter[Grade]] = {}
    for case in sheet.cases():
        for name in case.messages:
            counts.setdefault(name, Counter())[case.grade] += 1
    return [
        MessageRow(message=one, counts=counts.get(one.name, Counter())) for one in sheet.messages
    ]


def _grade(case: Case, rule: str) -> Grade:
    """Return what a case shows about a rule.

    A finding is about the rule that it names. The case decides nothing about its other rules, because it may
    have ended early.
    """
    named = [finding.grade for finding in case.findings if finding.rule == rule]
    if named:
        return min(named, key=list(Grade).index)
    has_findings = case.grade in (Grade.FAILED, Grade.DEVIATES)
    return Grade.NOTED if has_findings and _names_rules(case) else case.grade


def _names_rules(case: Case) -> bool:
    return any(finding.rule for finding in case.findings)


def pages(sheet: Sheet) -> list[PageRow]:
    """Return a row for each page with a rule or a message description, in order."""
    by_rule: dict[str, list[Case]] = {}
    by_message: dict[str, list[Case]] = {}
    for case in sheet.cases():
        for rule in dict.fromkeys((*case.rules, *(each.rule for each in case.findings))):
            by_rule.setdefault(rule, []).append(case)
        for message in case.messages:
            by_message.setdefault(message, []).append(case)
    rules: dict[PageReference, list[Rule]] = {}
    described: dict[PageReference, list[str]] = {}
    for one in sheet.rules.values():
        rules.setdefault(one.place, []).append(one)
    for message_facts in sheet.messages:
        for place in message_facts.places:
            described.setdefault(place, []).append(message_facts.name)
    found = []
    for place in sorted({*rules, *described}):
        here = rules.get(place, [])
        names = described.get(place, [])
        touching = {
            case.id: case.grade
            for cases in (
                *(by_rule.get(rule.id, []) for rule in here),
                *(by_message.get(name, []) for name in names),
            )
            for case in cases
        }
        rows = tuple(
            RuleRow(
                rule=rule,
                counts=Counter(_grade(case, rule.id) for case in by_rule.get(rule.id, [])),
            )
            for rule in here
        )
        found.append(
            PageRow(
                place=place,
                rules=rows,
                messages=tuple(names),
                counts=Counter(touching.values()),
            )
        )
    return found

"""The HTML page of a sheet: one self-contained file.

It has no scripts and loads nothing; it works on screens from 320 px, light and dark, and on paper. All text
from a controller is escaped, including invisible characters. Templates get numbers, tones, rows of bytes and
groups from the view.
"""

from __future__ import annotations

import hashlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

from stagewire import __version__
from stagewire_conformance.reports import coverage
from stagewire_conformance.reports.coverage import MessageRow, RuleRow
from stagewire_conformance.reports.model import (
    Case,
    Erratum,
    Fact,
    Finding,
    Grade,
    Group,
    Message,
    PageReference,
    Rule,
    Sheet,
    Transmission,
    Verdict,
)
from stagewire_conformance.reports.text import (
    GRADES,
    MEANING,
    MILDER,
    broken_rules,
    bytes_of,
    counted,
    gaps,
    is_milder_than_its_rule,
    named_messages,
    numbers,
    pieces,
    safe,
    sentence,
    shortened,
    where,
)

_LINES_OF_A_FAILURE = 120
_MOST_PASSED = 60
"""The maximum number of passed cases of a group that are shown individually."""

_MOST_LETTERS = 160
"""The maximum length of a text in the summary."""
_CERTIFICATE = {
    "Vendor": ("certificate_vendor",),
    "Product": ("certificate_product", "unit", "testee"),
    "Revision": ("certificate_revision", "testee_version"),
    "Tester": ("certificate_tester",),
}
"""The lines at the top of the summary, and the facts that they show: the first that is known."""

_TONES = {
    Grade.FAILED: "bad",
    Grade.DEVIATES: "odd",
    Grade.FRAGILE: "odd",
    Grade.NOTED: "note",
    Grade.PASSED: "good",
    Grade.SKIPPED: "out",
    Grade.NOT_RUN: "out",
}
_VERDICT_TONES = {
    Verdict.FAILED: "bad",
    Verdict.UNFINISHED: "bad",
    Verdict.NON_STRICT: "odd",
    Verdict.PARTIAL: "note",
    Verdict.PASSED: "good",
}
_SIGNS = {"bad": "✗", "odd": "△", "note": "i", "good": "✓", "out": "–"}


class View:
    """A sheet, prepared for the templates.

    :param sheet: the sheet to show.
    """

    most_gaps = 5
    """The maximum number of reasons for a partial run in the summary."""
    most_named = 40
    """The maximum number of omitted checks that are named for a reason."""

    def __init__(self, sheet: Sheet) -> None:
        self.sheet = sheet
        self.sentence = self.brief(sentence(sheet), 3 * _MOST_LETTERS)
        self.meaning = MEANING
        self._numbers = {case.id: number for number, case in enumerate(sheet.cases(), 1)}
        self._messages = {message.name: message for message in sheet.messages}

    # tones

    def tone(self, grade: Grade | None) -> str:
        """Return the CSS class of a grade; ``none`` without a grade."""
        return "none" if grade is None else _TONES[grade]

    @property
    def verdict_tone(self) -> str:
        """The CSS class of the verdict."""
        return _VERDICT_TONES[self.sheet.verdict]

    def sign(self, tone: str) -> str:
        """Return the symbol of a tone, so that colour is not needed to recognise it."""
        return _SIGNS.get(tone, "")

    def grade_word(self, grade: Grade | None) -> str:
        """Return the name of a grade."""
        return "nothing" if grade is None else GRADES[grade]

    def heading(self, grade: Grade) -> str:
        """Return the name of a grade as the heading of a narrow column."""
        return GRADES[grade].partition(" (")[0]

    @cached_property
    def certificate(self) -> list[tuple[str, str]]:
        """The lines that identify the implementation and the tester; empty values are not stated."""
        known = {fact.key: str(fact.value) for fact in self.sheet.facts}
        return [
            (label, next((known[key] for key in keys if known.get(key)), ""))
            for label, keys in _CERTIFICATE.items()
        ]

    @property
    def tester(self) -> str:
        """The tester, if stated."""
        return dict(self.certificate)["Tester"]

    @cached_property
    def facts(self) -> list[Fact]:
        """The other facts."""
        shown = {key for keys in _CERTIFICATE.values() for key in keys}
        shown |= {fact.key for fact in self.sheet.declaration if self.sheet.kind == "codec"}
        return [fact for fact in self.sheet.facts if fact.key not in shown]

    def brief(self, text: str, most: int = _MOST_LETTERS) -> str:
        """Return a text, truncated if it is long, so that the summary stays short."""
        return text if len(text) <= most else f"{text[:most]}…"

    @cached_property
    def gaps(self) -> list[str]:
        """The reasons why the run is partial; empty for a complete run."""
        return list(gaps(self.sheet))

    # numbers

    def anchor(self, case: Case) -> str:
        """Return the anchor of the full description of a case."""
        return f"case-{self._numbers[case.id]}"

    def counts(self, counts: Mapping[Grade, int]) -> str:
        """Return counts in words, the worst grade first."""
        return numbers(counts)

    def counted(self, number: int, thing: str, things: str = "") -> str:
        """Return ``1 check``, ``2 checks``."""
        return counted(number, thing, things)

    @cached_property
    def totals(self) -> list[tuple[Grade, int]]:
        """Every grade that occurs, with the number of its cases."""
        counts = self.sheet.counts()
        return [(grade, counts[grade]) for grade in GRADES if counts[grade]]

    # cases

    @cached_property
    def grave(self) -> list[Case]:
        """The cases that failed or are non-strict."""
        return list(self.sheet.grave())

    @cached_property
    def has_results(self) -> bool:
        """Whether any case was run."""
        return any(case.ran for case in self.sheet.cases())

    def is_grave(self, one: Case | Finding) -> bool:
        """Return whether a case or finding failed or is non-strict. Such a case is described in full."""
        return one.grade in (Grade.FAILED, Grade.DEVIATES, Grade.FRAGILE)

    def is_passed(self, case: Case) -> bool:
        """Return whether a case passed. It gets one line."""
        return case.grade is Grade.PASSED

    def parts(self, group: Group) -> tuple[list[Case], int]:
        """Return the cases of a group that ran and are listed, and the number of the others, which passed."""
        ran = [case for case in group.cases if case.ran]
        listed = [case for case in ran if not self.is_passed(case)]
        return (
            (ran, 0) if len(ran) - len(listed) <= _MOST_PASSED else (listed, len(ran) - len(listed))
        )

    def by_reason(self, grade: Grade) -> dict[str, list[Case]]:
        """Return the cases of a grade by the reason why they were omitted."""
        found: dict[str, list[Case]] = {}
        for case in self.sheet.cases(Grade(grade)):
            found.setdefault(case.why, []).append(case)
        return found

    # rules, errata and coverage

    def rules_of(self, case: Case) -> list[Rule]:
        """Return the rules that a case tests."""
        return [self.sheet.rules[name] for name in case.rules if name in self.sheet.rules]

    def broken_rules(self, case: Case) -> list[Rule]:
        """Return the rules that the findings of a case name, each once."""
        return broken_rules(self.sheet, case)

    def milder(self, case: Case) -> str:
        """Return why a case is NON-STRICT although its rule says must; empty if it is not."""
        return MILDER if is_milder_than_its_rule(self.sheet, case) else ""

    def named_messages(self, case: Case) -> str:
        """Return the messages that the findings of a case name, with their pages; empty if there are none."""
        named = named_messages(self.sheet, case)
        return "; ".join(f"{each.name} ({where(each.places)})" for each in named)

    def dependents(self, case: Case) -> list[Case]:
        """Return the cases that were not run because of the findings of a case."""
        return self.sheet.dependents(case)

    @cached_property
    def fragile(self) -> list[Case]:
        """The cases with a finding about robustness."""
        return list(self.sheet.cases(Grade.FRAGILE))

    def errata_of(self, case: Case) -> list[Erratum]:
        """Return the errata of the rules and messages of a case, each once."""
        names = [
            *(name for rule in self.rules_of(case) for name in rule.errata),
            *(name for message in self._about(case) for name in message.errata),
        ]
        return [
            self.sheet.errata[name] for name in dict.fromkeys(names) if name in self.sheet.errata
        ]

    def where(self, case: Case) -> str:
        """Return the pages that describe its messages, or otherwise those of its rules."""
        described = [place for message in self._about(case) for place in message.places]
        return where(sorted({*(described or [rule.place for rule in self.rules_of(case)])}))

    def _about(self, case: Case) -> list[Message]:
        return [self._messages[name] for name in case.messages if name in self._messages]

    def where_all(self, places: Iterable[PageReference]) -> str:
        """Return references to pages in short form."""
        return where(places)

    @cached_property
    def messages(self) -> list[MessageRow]:
        """Coverage by message. In a partial run, only the messages of the selected cases."""
        return [row for row in coverage.messages(self.sheet) if self._is_asked(row)]

    @cached_property
    def matrix(self) -> list[RuleRow]:
        """The rules that were tested, in the order of the document."""
        return [row for row in self._rules if row.grade is not None]

    @cached_property
    def untested(self) -> dict[str, list[Rule]]:
        """The other rules by the reason. In a partial run they are not listed."""
        found: dict[str, list[Rule]] = {}
        for row in [] if self.sheet.unselected else self._rules:
            if row.grade is None:
                found.setdefault(_why_untested(row.rule), []).append(row.rule)
        return found

    @cached_property
    def _rules(self) -> list[RuleRow]:
        return [row for page in coverage.pages(self.sheet) for row in page.rules]

    def _is_asked(self, row: MessageRow) -> bool:
        return not self.sheet.unselected or row.grade is not None

    @cached_property
    def errata(self) -> list[Erratum]:
        """The errata. In a partial run, only those about the selected cases."""
        if not self.sheet.unselected:
            return list(self.sheet.errata.values())
        found = {one.id: one for case in self.sheet.cases() for one in self.errata_of(case)}
        return list(found.values())

    @cached_property
    def waived(self) -> list[Rule]:
        """Rules for controllers that cannot be checked."""
        return [rule for rule in self.sheet.rules.values() if rule.waiver and not rule.for_host]

    def message_state(self, row: MessageRow) -> str:
        """Return the coverage of a message in words."""
        if row.grade is not None:
            return self.counts(row.counts)
        return "unsupported" if row.message.unsupported else "no check"

    # bytes

    def difference(self, finding: Finding) -> list[list[tuple[str, bool]]]:
        """Return expected and received bytes in aligned lines, or an empty list unless both are bytes."""
        if isinstance(finding.wanted, bytes) and isinstance(finding.came, bytes):
            return pieces(finding.wanted, finding.came)
        return []

    def plain(self, value: bytes | str) -> str:
        """Return bytes in hex, and text unchanged."""
        return (bytes_of(value) or "nothing") if isinstance(value, bytes) else value

    def lines(self, case: Case) -> list[Transmission | int]:
        """Return the dialogue of a case. In a long one a number replaces the omitted lines."""
        return shortened(case.lines, _LINES_OF_A_FAILURE)

    def is_gap(self, line: Transmission | int) -> bool:
        """Return whether a line is the number of omitted lines."""
        return isinstance(line, int)

    def hex(self, raw: bytes) -> str:
        """Return bytes in hex, shortened if there are many."""
        return bytes_of(raw)


def _why_untested(rule: Rule) -> str:
    if rule.for_host:
        return "Rules for hosts"
    return "Cannot be checked on the wire" if rule.waiver else "Without a check for this unit"


_PACKAGE = "stagewire_conformance.reports"


def as_html(sheet: Sheet) -> str:
    """Return a complete page, to be written in UTF-8.

    Raises :class:`ModuleNotFoundError` without the extra ``conformance``.
    """
    import jinja2
    from markupsafe import Markup

    def shown(value: Any) -> Any:
        """Escape invisible characters in all output of the templates. Autoescape does the rest."""
        return value if isinstance(value, Markup) or not isinstance(value, str) else safe(value)

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_PACKAGE),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        finalize=shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = environment.get_template("style.css.j2").render()
    digest = b64encode(hashlib.sha256(style.encode("utf-8")).digest()).decode("ascii")
    return environment.get_template("page.html.j2").render(
        view=View(sheet), sheet=sheet, style=Markup(style), style_digest=digest, version=__version__
    )

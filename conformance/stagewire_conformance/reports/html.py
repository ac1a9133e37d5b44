"""The HTML page of a sheet, which needs nothing but itself, for people and their customers.

No script, no request to anywhere; for screens from 320 px up, light and dark, and for paper. Everything that
comes from a controller is escaped, and so are invisible characters. Templates ask the view for numbers,
tones, bytes in rows and groups.
"""

from __future__ import annotations

import hashlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from stagewire import __version__
from stagewire_conformance.reports import coverage
from stagewire_conformance.reports.coverage import MessageRow, PageRow, RuleRow
from stagewire_conformance.reports.model import (
    Case,
    Erratum,
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
    bytes_of,
    counted,
    numbers,
    pieces,
    safe,
    sentence,
    shortened,
    where,
)

_LINES_OF_A_FAILURE = 120
_LINES_OF_OTHERS = 24
_MOST_PASSED = 60
"""Cases of a group that passed and are shown each in a row of its own."""

_TONES = {
    Grade.FAILED: "bad",
    Grade.DEVIATES: "odd",
    Grade.NOTED: "note",
    Grade.PASSED: "good",
    Grade.SKIPPED: "out",
    Grade.NOT_RUN: "out",
}
_VERDICT_TONES = {
    Verdict.FAILED: "bad",
    Verdict.UNFINISHED: "bad",
    Verdict.NON_STRICT: "odd",
    Verdict.PASSED: "good",
}
_SIGNS = {"bad": "✗", "odd": "△", "note": "i", "good": "✓", "out": "–"}


class View:
    """A sheet as the page shows it.

    :param sheet: what is shown.
    """

    def __init__(self, sheet: Sheet) -> None:
        self.sheet = sheet
        self.sentence = sentence(sheet)
        self.meaning = MEANING
        self._numbers = {case.id: number for number, case in enumerate(sheet.cases(), 1)}
        self._messages = {message.name: message for message in sheet.messages}

    # tones

    def tone(self, grade: Grade | None) -> str:
        """Return the class of a grade; ``none`` where there is nothing to grade."""
        return "none" if grade is None else _TONES[grade]

    @property
    def verdict_tone(self) -> str:
        """The class of the verdict."""
        return _VERDICT_TONES[self.sheet.verdict]

    def sign(self, tone: str) -> str:
        """Return the sign of a tone, so that no one needs its colour."""
        return _SIGNS.get(tone, "")

    def grade_word(self, grade: Grade | None) -> str:
        """Return a grade in words."""
        return "nothing" if grade is None else GRADES[grade]

    # numbers

    def anchor(self, case: Case) -> str:
        """Return the name of the place where a case is told in full."""
        return f"case-{self._numbers[case.id]}"

    def counts(self, counts: Mapping[Grade, int]) -> str:
        """Return counts in words, the gravest first."""
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
        """What failed, and what departs from advice."""
        return list(self.sheet.grave())

    @cached_property
    def has_results(self) -> bool:
        """Whether anything ran."""
        return any(case.ran for case in self.sheet.cases())

    @cached_property
    def told(self) -> list[Case]:
        """The others of which there is a dialogue to show."""
        return [case for case in self.sheet.cases(Grade.PASSED, Grade.NOTED) if case.lines]

    def is_grave(self, one: Case | Finding) -> bool:
        """Return whether something failed or departs from advice; such a case is told in full."""
        return one.grade in (Grade.FAILED, Grade.DEVIATES)

    def parts(self, group: Group) -> tuple[list[Case], list[Case]]:
        """Return the cases of a group that ran: those to show, and those that would only make it long."""
        ran = [case for case in group.cases if case.ran]
        plain = [case for case in ran if case.grade is Grade.PASSED]
        if len(plain) <= _MOST_PASSED:
            return ran, []
        return [case for case in ran if case.grade is not Grade.PASSED], plain

    def by_reason(self, grade: Grade) -> dict[str, list[Case]]:
        """Return the cases of a grade by why they were left out."""
        found: dict[str, list[Case]] = {}
        for case in self.sheet.cases(Grade(grade)):
            found.setdefault(case.why, []).append(case)
        return found

    # rules, errata and coverage

    def rules_of(self, case: Case) -> list[Rule]:
        """Return the rules that a case holds to."""
        return [self.sheet.rules[name] for name in case.rules if name in self.sheet.rules]

    def rules_of_group(self, group: Group) -> list[Rule]:
        """Return the rules that the cases of a group hold to, each once, in the order of the document."""
        names = {name for case in group.cases for name in case.rules}
        return [rule for name, rule in self.sheet.rules.items() if name in names]

    def errata_of(self, case: Case) -> list[Erratum]:
        """Return the errata of the rules and messages that a case is about, each once."""
        names = [
            *(name for rule in self.rules_of(case) for name in rule.errata),
            *(name for message in self._about(case) for name in message.errata),
        ]
        return [
            self.sheet.errata[name] for name in dict.fromkeys(names) if name in self.sheet.errata
        ]

    def where(self, case: Case) -> str:
        """Return where in the document its messages are described; of one without, where its rules stand."""
        described = [place for message in self._about(case) for place in message.places]
        return where(sorted({*(described or [rule.place for rule in self.rules_of(case)])}))

    def _about(self, case: Case) -> list[Message]:
        return [self._messages[name] for name in case.messages if name in self._messages]

    def where_all(self, places: Iterable[PageReference]) -> str:
        """Return places in a few words."""
        return where(places)

    @cached_property
    def messages(self) -> list[MessageRow]:
        """Coverage by message; where only some cases were asked for, of those that they are about."""
        return [row for row in coverage.messages(self.sheet) if self._is_asked(row)]

    @cached_property
    def pages(self) -> list[PageRow]:
        """Coverage by page; where only some cases were asked for, of what they are about."""
        return [
            replace(
                row,
                rules=tuple(filter(self._is_asked, row.rules)),
                messages=tuple(name for name in row.messages if name in self._asked),
            )
            for row in coverage.pages(self.sheet)
            if self._is_asked(row)
        ]

    @cached_property
    def _asked(self) -> frozenset[str]:
        """The messages that are listed."""
        return frozenset(row.message.name for row in self.messages)

    def _is_asked(self, row: MessageRow | PageRow | RuleRow) -> bool:
        return self.sheet.whole or row.grade is not None

    @cached_property
    def errata(self) -> list[Erratum]:
        """The errata; where only some cases were asked for, of what they are about."""
        if self.sheet.whole:
            return list(self.sheet.errata.values())
        found = {one.id: one for case in self.sheet.cases() for one in self.errata_of(case)}
        return list(found.values())

    @cached_property
    def waived(self) -> list[Rule]:
        """Rules that no case can see, and that bind controllers."""
        return [rule for rule in self.sheet.rules.values() if rule.waiver and not rule.for_host]

    def rule_state(self, row: RuleRow) -> str:
        """Return in words how a rule was covered."""
        if row.grade is not None:
            return self.counts(row.counts)
        if row.rule.for_host:
            return "binds the host"
        return "no check can see it" if row.rule.waiver else "nothing of this unit to check"

    def message_state(self, row: MessageRow) -> str:
        """Return in words how a message was covered."""
        if row.grade is not None:
            return self.counts(row.counts)
        return "not claimed" if row.message.unsupported else "no check"

    # bytes

    def difference(self, finding: Finding) -> list[list[tuple[str, bool]]]:
        """Return wanted and came below each other in lines and pieces, where both are bytes; else nothing."""
        if isinstance(finding.wanted, bytes) and isinstance(finding.came, bytes):
            return pieces(finding.wanted, finding.came)
        return []

    def plain(self, value: bytes | str) -> str:
        """Return bytes in hex, and a text as it is."""
        return (bytes_of(value) or "nothing") if isinstance(value, bytes) else value

    def lines(self, case: Case) -> list[Transmission | int]:
        """Return the dialogue of a case; of a long one the middle is a number."""
        most = (
            _LINES_OF_OTHERS if case.grade in (Grade.PASSED, Grade.NOTED) else _LINES_OF_A_FAILURE
        )
        return shortened(case.lines, most)

    def is_gap(self, line: Transmission | int) -> bool:
        """Return whether it stands for lines that are left out."""
        return isinstance(line, int)

    def hex(self, raw: bytes) -> str:
        """Return bytes in hex; of many, the first."""
        return bytes_of(raw)


_PACKAGE = "stagewire_conformance.reports"


def as_html(sheet: Sheet) -> str:
    """Return a whole page, as text that is to be written in UTF-8.

    Raises :class:`ModuleNotFoundError` without the extra ``conformance``.
    """
    import jinja2
    from markupsafe import Markup

    def shown(value: Any) -> Any:
        """Escape what no one can see, in whatever a template shows; autoescape does the rest."""
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

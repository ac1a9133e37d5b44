"""The contents of a report, independent of its format: cases in groups, rules, errata.

A run against a device and a run against a codec both become a :class:`Sheet`. The writers use only this
model.
"""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final


class Grade(enum.StrEnum):
    """The grade of a case, the worst first."""

    FAILED = "failed"
    DEVIATES = "deviates"
    FRAGILE = "fragile"
    NOTED = "noted"
    PASSED = "passed"
    SKIPPED = "skipped"
    NOT_RUN = "not run"


class Verdict(enum.StrEnum):
    """The verdict of a run."""

    FAILED = "FAILED"
    UNFINISHED = "NOT FINISHED"
    NON_STRICT = "NON-STRICT"
    PARTIAL = "PASSED IN PART"
    PASSED = "PASSED"

    @property
    def exit_status(self) -> int:
        """The exit status for this verdict."""
        return _EXIT_STATUS[self]


_EXIT_STATUS: Final = {
    Verdict.PASSED: 0,
    Verdict.PARTIAL: 0,
    Verdict.FAILED: 1,
    Verdict.NON_STRICT: 3,
    Verdict.UNFINISHED: 4,
}
"""2 is reserved for invalid usage, before anything is run."""

INTERRUPTED: Final = 130
"""The exit status after Ctrl-C or SIGTERM, as in shells."""


class Omission(enum.StrEnum):
    """The kind of reason why a case was not run."""

    SELECTION = "selection"
    PERMISSION = "permission"
    IMPOSSIBLE = "impossible"
    NOT_IMPLEMENTED = "not implemented"
    CAUSE = "root cause"
    INTERRUPTED = "interrupted"
    ENDED = "ended"


@dataclass(frozen=True, kw_only=True)
class Gap:
    """One reason why a run is partial.

    :param why: the reason.
    :param cases: the number of cases that were not run because of it; 0 if the last case was cut short.
    """

    omission: Omission
    why: str
    cases: int


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """One piece of a dialogue.

    :param time: in seconds since the run began.
    :param sent: whether it was sent to the implementation under test.
    :param raw: the bytes; for a testee, the line.
    :param text: a description in one line.
    :param minor: whether it may be omitted, such as a keep-alive message.
    """

    time: float
    sent: bool
    raw: bytes
    text: str = ""
    minor: bool = False


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One observation.

    :param text: a sentence that states what was received and what was expected.
    :param wanted: the expected bytes or text; None if unknown.
    :param came: the received bytes or text; None if there are none.
    :param rule: the id of the rule that is broken; empty if there is none.
    """

    grade: Grade
    text: str
    wanted: bytes | str | None = None
    came: bytes | str | None = None
    rule: str = ""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One test that was run or omitted.

    :param id: unique in the sheet, and the same in every run.
    :param title: the expectation, in one sentence.
    :param word: the name of its result: ``FAIL``, ``accepted wrongly``.
    :param why: the reason why it was skipped or not run.
    :param omission: the kind of this reason, if it was not run.
    :param causes: the ids of the cases that report a defect that this case also met.
    :param messages: the messages that it is about.
    :param rules: the ids of the rules that it tests.
    :param figures: measured values, such as ``p99_ms``.
    :param restored: the changes that were undone afterwards.
    :param repeat: the command that repeats it; empty if there is none.
    :param seconds: the duration.
    """

    id: str
    title: str
    grade: Grade
    word: str
    why: str = ""
    omission: Omission = Omission.IMPOSSIBLE
    causes: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    lines: tuple[Transmission, ...] = ()
    messages: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()
    figures: Mapping[str, float] = field(default_factory=dict)
    restored: tuple[str, ...] = ()
    repeat: str = ""
    seconds: float = 0.0

    @property
    def ran(self) -> bool:
        """Whether it was run."""
        return self.grade not in (Grade.SKIPPED, Grade.NOT_RUN)


@dataclass(frozen=True, kw_only=True)
class Group:
    """Cases that belong together.

    :param name: a short name, as accepted by ``--only``.
    """

    name: str
    title: str
    cases: tuple[Case, ...]

    def counts(self) -> Counter[Grade]:
        """Return the number of cases by grade."""
        return Counter(case.grade for case in self.cases)


@dataclass(frozen=True, slots=True)
class PageReference:
    """A page or section of a document.

    :param protocol: the protocol of the document.
    :param number: of the page or section.
    :param name: such as ``page 30``, or ``Issue 37, page 58`` if the protocol has several documents.
    """

    protocol: str
    number: int
    name: str

    @property
    def document(self) -> str:
        """The name of the document; empty if the protocol has only one."""
        document, found, _ = self.name.partition(", page ")
        return document if found else ""

    def __lt__(self, other: PageReference) -> bool:
        """Return whether it comes first: by protocol, document and number."""
        return self._order < other._order

    @property
    def _order(self) -> tuple[str, str, int, str]:
        return self.protocol, self.document, self.number, self.name


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A rule of the document.

    :param strength: ``must`` or ``should``.
    :param states: the requirement, in our own words.
    :param means: what follows from it; empty if that is obvious.
    :param waiver: why it cannot be checked; empty if it can.
    :param for_host: whether it applies to hosts instead of controllers.
    """

    id: str
    place: PageReference
    strength: str
    states: str
    means: str = ""
    errata: tuple[str, ...] = ()
    waiver: str = ""
    for_host: bool = False


@dataclass(frozen=True, kw_only=True)
class Erratum:
    """An error in the document.

    :param subject: its subject.
    :param printed: the printed version.
    :param encoded: the correct version.
    """

    id: str
    places: tuple[PageReference, ...]
    subject: str
    printed: str
    encoded: str
    evidence: str


@dataclass(frozen=True, kw_only=True)
class Message:
    """A message that cases can be about.

    :param places: the pages that describe it.
    :param unsupported: why it is not supported; empty if it is.
    """

    name: str
    places: tuple[PageReference, ...]
    errata: tuple[str, ...] = ()
    unsupported: str = ""


@dataclass(frozen=True, kw_only=True)
class Fact:
    """A fact about the run.

    :param key: its name for programs.
    :param label: its name for people.
    """

    key: str
    label: str
    value: str | int | float | bool | None


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A complete report.

    :param kind: ``device`` or ``codec``.
    :param title: such as ``Conformance of the TDC001``.
    :param protocols: name -> title of the document.
    :param facts: about the implementation under test, the line and the permissions, in display order.
    :param declaration: the declaration of its vendor (PICS), in display order; empty without one.
    :param digests: name -> SHA-256 in hex of an input of the run.
    :param command: repeats the whole run.
    :param unfinished: why the run did not finish; empty if it did.
    :param messages: every message that cases can be about, in the order of the document.
    :param unselected: the number of cases that were not selected. If there are any, the coverage is limited
        to the selected ones.
    :param missed: permissions that were not used, with the reasons.
    :param interrupted: whether Ctrl-C or SIGTERM ended the run.
    :param adrift: sentences about the parts that may still be moving, shining or heating after the run.
        Every report shows them prominently.
    """

    kind: str
    title: str
    protocols: Mapping[str, str]
    started: datetime
    seconds: float
    seed: int | None
    facts: tuple[Fact, ...]
    digests: Mapping[str, str]
    command: str
    groups: tuple[Group, ...]
    unfinished: str = ""
    rules: Mapping[str, Rule] = field(default_factory=dict)
    errata: Mapping[str, Erratum] = field(default_factory=dict)
    messages: tuple[Message, ...] = ()
    unselected: int = 0
    missed: tuple[str, ...] = ()
    declaration: tuple[Fact, ...] = ()
    interrupted: bool = False
    adrift: tuple[str, ...] = ()

    def cases(self, *grades: Grade) -> Iterator[Case]:
        """Yield the cases of these grades, or all, in order."""
        for group in self.groups:
            for case in group.cases:
                if not grades or case.grade in grades:
                    yield case

    def grave(self) -> Iterator[Case]:
        """Yield the failed cases, then the non-strict ones."""
        yield from self.cases(Grade.FAILED)
        yield from self.cases(Grade.DEVIATES)

    def dependents(self, case: Case) -> list[Case]:
        """Return the cases that met a defect which a case reports."""
        return [each for each in self.cases() if case.id in each.causes]

    def counts(self) -> Counter[Grade]:
        """Return the number of cases by grade."""
        return sum((group.counts() for group in self.groups), Counter())

    @property
    def gaps(self) -> tuple[Gap, ...]:
        """The reasons why the run is partial, by kind; empty for a complete run.

        Cases that the implementation under test is not declared to support do not make a run partial.
        """
        numbers: Counter[tuple[Omission, str]] = Counter()
        if self.unselected:
            numbers[Omission.SELECTION, "not selected"] = self.unselected
        if self.unfinished:
            numbers[self._ended, self.unfinished] = 0
        for case in self.cases(Grade.NOT_RUN):
            omission = self.omission_of(case)
            why = self.unfinished if omission is self._ended else case.why
            numbers[omission, why] += 1
        found = [
            Gap(omission=omission, why=why, cases=number)
            for (omission, why), number in numbers.items()
        ]
        return tuple(sorted(found, key=lambda gap: list(Omission).index(gap.omission)))

    def omission_of(self, case: Case) -> Omission:
        """Return the kind of reason why a case was not run."""
        return self._ended if case.omission is Omission.ENDED else case.omission

    @property
    def _ended(self) -> Omission:
        return Omission.INTERRUPTED if self.interrupted else Omission.ENDED

    @property
    def complete(self) -> bool:
        """Whether every case was run that the implementation under test is declared to support."""
        return not self.gaps

    @property
    def verdict(self) -> Verdict:
        """The verdict of the run: a failure outweighs an early end, which outweighs all else.

        A run after which something may still be moving, shining or heating counts as ended early. A partial
        run never has the verdict ``PASSED``. Findings about robustness do not count: no sentence of
        the document demands it.
        """
        counts = self.counts()
        if counts[Grade.FAILED]:
            return Verdict.FAILED
        if self.unfinished or self.adrift:
            return Verdict.UNFINISHED
        if counts[Grade.DEVIATES]:
            return Verdict.NON_STRICT
        return Verdict.PASSED if self.complete else Verdict.PARTIAL

    @property
    def headline(self) -> str:
        """The verdict, and whether the run was complete. Every report shows it in its title."""
        return f"{self.verdict} ({'complete' if self.complete else 'partial'} run)"

    @property
    def exit_status(self) -> int:
        """The exit status for the verdict, or for an interruption."""
        return INTERRUPTED if self.interrupted else self.verdict.exit_status

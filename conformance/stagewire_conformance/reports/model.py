"""What a report says, whatever was tested and however it is written: cases in groups, rules, errata.

A run of a device and a run of a codec both become a :class:`Sheet`; the writers know nothing else.
"""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final


class Grade(enum.StrEnum):
    """How a case counts, the gravest first."""

    FAILED = "failed"
    DEVIATES = "deviates"
    NOTED = "noted"
    PASSED = "passed"
    SKIPPED = "skipped"
    NOT_RUN = "not run"


class Verdict(enum.StrEnum):
    """What a run comes to."""

    FAILED = "FAILED"
    UNFINISHED = "NOT FINISHED"
    NON_STRICT = "NON-STRICT"
    PASSED = "PASSED"

    @property
    def exit_status(self) -> int:
        """The exit status of a command that comes to this verdict."""
        return _EXIT_STATUS[self]


_EXIT_STATUS: Final = {
    Verdict.PASSED: 0,
    Verdict.FAILED: 1,
    Verdict.NON_STRICT: 3,
    Verdict.UNFINISHED: 4,
}
"""2 is left to a command that was called wrongly, before anything was run."""

INTERRUPTED: Final = 130
"""The exit status of a run that was ended by Ctrl-C or SIGTERM, as shells report it."""


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """One piece of what was said.

    :param time: in seconds since the run began.
    :param sent: whether it went to what is tested.
    :param raw: the bytes; of a testee that answers lines, the line.
    :param text: the same in words, in one line.
    :param minor: whether readers can do without it, such as a sign of life.
    """

    time: float
    sent: bool
    raw: bytes
    text: str = ""
    minor: bool = False


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was found.

    :param text: a sentence: what came, and what should have come.
    :param wanted: the bytes that should have come, or a text; None where there are none to show.
    :param came: likewise what came.
    """

    grade: Grade
    text: str
    wanted: bytes | str | None = None
    came: bytes | str | None = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """One thing that was tested, or left out.

    :param id: unique in the sheet, and the same in every run.
    :param title: what is expected, in one sentence.
    :param word: how its result is called: ``FAIL``, ``accepted wrongly``.
    :param why: of one that was skipped or not run: the reason.
    :param messages: the messages that it is about.
    :param rules: the rules that it holds to, by id.
    :param figures: what was measured, such as ``p99_ms``.
    :param restored: what was set back afterwards.
    :param repeat: the command that runs this case again; empty where there is none.
    :param seconds: how long it took.
    """

    id: str
    title: str
    grade: Grade
    word: str
    why: str = ""
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
        """Whether something was asked of what is tested."""
        return self.grade not in (Grade.SKIPPED, Grade.NOT_RUN)


@dataclass(frozen=True, kw_only=True)
class Group:
    """Cases that belong together.

    :param name: short, as ``--only`` takes it.
    """

    name: str
    title: str
    cases: tuple[Case, ...]

    def counts(self) -> Counter[Grade]:
        """Return how many cases have which grade."""
        return Counter(case.grade for case in self.cases)


@dataclass(frozen=True, order=True, slots=True)
class PageReference:
    """A page or section of a document.

    :param protocol: whose document it is.
    :param number: of the page or section.
    :param name: the same in words, such as ``page 30``.
    """

    protocol: str
    number: int
    name: str


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A rule of the document.

    :param strength: ``must`` or ``should``.
    :param says: the document's own words.
    :param means: the same in plain words, where its own are not.
    :param waiver: why no case can see it; empty where one can.
    :param for_host: whether it binds hosts, not controllers.
    """

    id: str
    place: PageReference
    strength: str
    says: str
    means: str = ""
    errata: tuple[str, ...] = ()
    waiver: str = ""
    for_host: bool = False


@dataclass(frozen=True, kw_only=True)
class Erratum:
    """A mistake of the document.

    :param subject: what it is about.
    :param printed: what the document has.
    :param encoded: what is right.
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

    :param places: where it is described.
    :param unsupported: why it is not claimed to be there; empty where it is.
    """

    name: str
    places: tuple[PageReference, ...]
    errata: tuple[str, ...] = ()
    unsupported: str = ""


@dataclass(frozen=True, kw_only=True)
class Fact:
    """Something to know of the run.

    :param key: its name for programs.
    :param label: for people.
    """

    key: str
    label: str
    value: str | int | float | bool | None


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A whole report.

    :param kind: ``device`` or ``codec``.
    :param title: such as ``Conformance of the TDC001``.
    :param protocols: name -> title of the document.
    :param facts: what was tested, where, with what allowed, in the order in which they are shown.
    :param digests: name -> SHA-256 in hex of what the run depends on.
    :param command: what repeats the whole run.
    :param unfinished: why the run did not come to its end; empty when it did.
    :param messages: every message that cases could be about, in the order of the document.
    :param whole: whether all cases were asked for; else what none of the chosen is about is left out.
    :param missed: in words, what was allowed and did not come about, and why.
    :param interrupted: whether the run was ended by Ctrl-C or SIGTERM.
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
    whole: bool = True
    missed: tuple[str, ...] = ()
    interrupted: bool = False

    def cases(self, *grades: Grade) -> Iterator[Case]:
        """Yield the cases of these grades, or all, in order."""
        for group in self.groups:
            for case in group.cases:
                if not grades or case.grade in grades:
                    yield case

    def grave(self) -> Iterator[Case]:
        """Yield what failed, and then what departs from advice."""
        yield from self.cases(Grade.FAILED)
        yield from self.cases(Grade.DEVIATES)

    def counts(self) -> Counter[Grade]:
        """Return how many cases have which grade."""
        return sum((group.counts() for group in self.groups), Counter())

    @property
    def verdict(self) -> Verdict:
        """What the run comes to: a failure weighs more than an early end, and that more than the rest."""
        counts = self.counts()
        if counts[Grade.FAILED]:
            return Verdict.FAILED
        if self.unfinished:
            return Verdict.UNFINISHED
        return Verdict.NON_STRICT if counts[Grade.DEVIATES] else Verdict.PASSED

    @property
    def exit_status(self) -> int:
        """The exit status of a command that made this run: that of its verdict, or of an interruption."""
        return INTERRUPTED if self.interrupted else self.verdict.exit_status

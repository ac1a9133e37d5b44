"""Verdicts of worked examples and captures: one of each, and what a run of them comes to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

PASSED = "passed"
FAILED = "failed"
NOTED = "noted"  # prose that no program can check: listed, and counted apart


@dataclass(frozen=True, slots=True)
class Verdict:
    """One worked example or capture, what it should do, and whether it does.

    :param id: its slug in the examples or captures of the registry.
    :param page: page of the document; None for a capture.
    :param line: line of the document's text; None for a capture.
    :param kind: tx, rx, lost, keyboard, stream, number_format, scaling, statement; or a capture's own words.
    :param message: the message that it is about, if any.
    :param title: what it is, for people.
    :param expected: reproduced, erratum or rejected.
    :param outcome: :data:`PASSED`, :data:`FAILED` or :data:`NOTED`.
    :param detail: why it failed, or what is worth saying though it passed.
    """

    id: str
    page: int | None
    line: int | None
    kind: str
    message: str
    title: str
    expected: str
    outcome: str
    detail: str

    @property
    def failed(self) -> bool:
        """Whether it does not do what it should."""
        return self.outcome == FAILED


@dataclass(slots=True)
class Findings:
    """What was found while one example ran."""

    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    checked: bool = True

    def expect(self, right: bool, problem: str) -> bool:
        """Note a problem unless ``right``; return ``right``."""
        if not right:
            self.problems.append(problem)
        return right

    @property
    def outcome(self) -> str:
        """Failed when there is a problem, passed when something was checked and there is none."""
        if self.problems:
            return FAILED
        return PASSED if self.checked else NOTED

    @property
    def detail(self) -> str:
        """All problems, or else all notes, in one line."""
        return "; ".join(self.problems or self.notes)


def succeeded(verdicts: Sequence[Verdict]) -> bool:
    """Return whether a run succeeded: something was run, and nothing failed."""
    return bool(verdicts) and not any(verdict.failed for verdict in verdicts)


def summary_of(verdicts: Sequence[Verdict]) -> str:
    """Return one line: how many of which verdict, and how many failed."""
    if not verdicts:
        return "there are no worked examples: nothing was checked"
    captures = sum(verdict.page is None for verdict in verdicts)
    kinds = Counter(verdict.expected for verdict in verdicts)
    listed = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
    outcomes = Counter(verdict.outcome for verdict in verdicts)
    return (
        f"{len(verdicts) - captures} examples and {captures} captures: {listed}; "
        f"{outcomes[PASSED]} passed, {outcomes[FAILED]} failed, "
        f"{outcomes[NOTED]} noted (prose that no program can check)"
    )

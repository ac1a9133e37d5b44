"""Verdicts of worked examples and captures, and the summary of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

PASSED = "passed"
FAILED = "failed"
NOTED = "noted"  # prose that a program cannot check: listed and counted separately


@dataclass(frozen=True, slots=True)
class Verdict:
    """One worked example or capture, with its expected and actual result.

    :param id: its slug in the examples or captures of the registry.
    :param page: page of the document; None for a capture.
    :param line: line of the document's text; None for a capture.
    :param kind: tx, rx, lost, keyboard, stream, number_format, scaling, statement; or the kind of a capture.
    :param message: the message that it is about, if any.
    :param title: a description.
    :param expected: reproduced, erratum or rejected.
    :param outcome: :data:`PASSED`, :data:`FAILED` or :data:`NOTED`.
    :param detail: why it failed, or a note.
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
        """Whether the result differs from the expected one."""
        return self.outcome == FAILED


@dataclass(slots=True)
class Findings:
    """Problems and notes of one example."""

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
        """Failed if there is a problem, passed if something was checked, otherwise noted."""
        if self.problems:
            return FAILED
        return PASSED if self.checked else NOTED

    @property
    def detail(self) -> str:
        """All problems, or otherwise all notes, in one line."""
        return "; ".join(self.problems or self.notes)


def succeeded(verdicts: Sequence[Verdict]) -> bool:
    """Return whether a run succeeded: something was run, and nothing failed."""
    return bool(verdicts) and not any(verdict.failed for verdict in verdicts)


def summary_of(verdicts: Sequence[Verdict]) -> str:
    """Return the number of examples by verdict and by outcome, in one line."""
    if not verdicts:
        return "no worked examples found; nothing was checked"
    captures = sum(verdict.page is None for verdict in verdicts)
    kinds = Counter(verdict.expected for verdict in verdicts)
    listed = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
    outcomes = Counter(verdict.outcome for verdict in verdicts)
    return (
        f"{len(verdicts) - captures} examples and {captures} captures: {listed}; "
        f"{outcomes[PASSED]} passed, {outcomes[FAILED]} failed, "
        f"{outcomes[NOTED]} noted (prose that a program cannot check)"
    )

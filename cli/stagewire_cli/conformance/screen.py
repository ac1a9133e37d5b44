"""A sheet on a terminal: a table by kind, what is not right with its bytes, and one line at the end."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer

from stagewire_cli.output import console, printable, table
from stagewire_conformance.reports import Case, Grade, Sheet, Verdict
from stagewire_conformance.reports.text import GRADES, case_text, counted, listed, sentence

__all__ = ["listing", "show_end", "show_results"]

_STYLES = {Grade.FAILED: "bold red", Grade.DEVIATES: "yellow", Grade.NOTED: "cyan"}
_VERDICT_STYLES = {
    Verdict.FAILED: "bold red",
    Verdict.UNFINISHED: "bold red",
    Verdict.NON_STRICT: "yellow",
    Verdict.PASSED: "green",
}
_MOST_IN_FULL = 12
"""Failures and departures that are shown with their bytes; of more there is a line each."""


@contextmanager
def listing() -> Iterator[None]:
    """Print a list; nothing is wrong where its reader, such as ``head``, has enough of it."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # Rich makes of the one the other
        pass


def show_results(sheet: Sheet) -> None:
    """Print a table by kind, and below it everything that is not simply right."""
    if not any(case.ran for case in sheet.cases()):
        return
    _show_kinds(sheet)
    out = console()
    grave = list(sheet.grave())
    for case in grave[:_MOST_IN_FULL]:
        _show_case(sheet, case)
    for case in grave[_MOST_IN_FULL:]:
        out.print(f"{case.word} {case.id}: {_first_words(case)}", style=_STYLES[case.grade])
    for case in sheet.cases(Grade.NOTED):
        for finding in case.findings:
            out.print(
                f"{case.word} {case.id}: {printable(finding.text)}", style=_STYLES[case.grade]
            )
    for grade in (Grade.SKIPPED, Grade.NOT_RUN):
        _show_left_out(sheet, grade)


def _show_kinds(sheet: Sheet) -> None:
    grades = [grade for grade in GRADES if sheet.counts()[grade]]
    names = {grade: _heading(sheet, grade) for grade in grades}
    shown = table("kind", "what holds if it passes", *names.values(), right=tuple(names.values()))
    for group in sheet.groups:
        counts = group.counts()
        worst = next((grade for grade in Grade if counts[grade]), None)
        numbers = (str(counts[grade] or "") for grade in grades)
        style = _STYLES.get(worst) if worst else None
        shown.add_row(group.name, printable(group.title), *numbers, style=style)
    console().print(shown)


def _heading(sheet: Sheet, grade: Grade) -> str:
    """Return how results of a grade are called: by their own word where all have the same."""
    words = {case.word for case in sheet.cases(grade)}
    return words.pop() if len(words) == 1 else GRADES[grade]


def _show_case(sheet: Sheet, case: Case) -> None:
    out = console()
    out.print()
    out.print(f"{case.word} {case.id}: {printable(case.title)}", style=_STYLES[case.grade])
    for line in case_text(sheet, case):
        out.print(f"  {line}", soft_wrap=True)


def _first_words(case: Case) -> str:
    return printable(next((finding.text for finding in case.findings), case.title))


def _show_left_out(sheet: Sheet, grade: Grade) -> None:
    reasons: dict[str, list[str]] = {}
    for case in sheet.cases(grade):
        reasons.setdefault(case.why, []).append(case.id)
    for why, ids in reasons.items():
        word = _heading(sheet, grade)
        typer.echo(f"{word}: {counted(len(ids), 'check')}: {printable(why)}: {listed(ids, 3)}")


def show_end(sheet: Sheet, written: Sequence[Path]) -> None:
    """Print what the run comes to, as the last line; before it which files there are."""
    for path in written:
        typer.echo(f"written: {printable(str(path))}")
    console().print(
        f"{sheet.verdict}: {printable(sheet.title)}: {printable(sentence(sheet))}",
        style=_VERDICT_STYLES[sheet.verdict],
        soft_wrap=True,
    )

"""Sheets: report files with their options, and the results on a terminal.

Files are checked before a run and written after it. The terminal shows a table by kind, all problems with
their bytes, and one line at the end.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import check_output, console, output, printable, table
from stagewire_conformance.reports import (
    Case,
    Grade,
    Sheet,
    Verdict,
    as_html,
    as_json,
    as_junit,
)
from stagewire_conformance.reports.text import (
    GRADES,
    case_text,
    counted,
    listed,
    not_at_rest,
    sentence,
)

Junit = Annotated[
    Path | None,
    typer.Option("--junit", metavar="FILE", help="Write a report for CI servers (JUnit XML)."),
]
Json = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write a report for programs (JSON).")
]
Html = Annotated[
    Path | None,
    typer.Option("--html", metavar="FILE", help="Write a report for people (HTML)."),
]

_NEEDED = {"--junit": "junitparser", "--html": "jinja2"}
"""The optional module that an option requires."""


@dataclass(frozen=True)
class ReportFiles:
    """The requested report files.

    :param others: further files of the command by their options, which must not be overwritten.
    """

    junit: Path | None = None
    json: Path | None = None
    html: Path | None = None
    others: tuple[tuple[str, Path | None], ...] = ()

    def check(self) -> None:
        """Check before a run that the reports can be written after it.

        Raises :class:`CalledWronglyError` for a file that cannot be created, for two options with the same
        file, and for a missing module.
        """
        seen: dict[Path, str] = {}
        for option, path in (*self._wanted(), *self.others):
            if path is None:
                continue
            place = Path(os.path.realpath(path))
            if place in seen:
                raise CalledWronglyError(f"{seen[place]} and {option} name the same file, {path}")
            seen[place] = option
        for option, path in self._wanted():
            if path is None:
                continue
            self.check_file(path, option)
            _check_needed(option)

    @staticmethod
    def check_file(path: Path, option: str) -> None:
        """Raise :class:`CalledWronglyError` for a file that cannot be created, and for ``-``."""
        if str(path) == "-":
            raise CalledWronglyError(f"{option}: - is not a file; give a file name")
        check_output(path, None, option)

    def write(self, sheet: Sheet) -> list[Path]:
        """Write all reports and return their files; each file appears when it is complete.

        Raises :class:`CalledWronglyError` for reports that could not be written, after writing the others.
        """
        writers = {"--junit": as_junit, "--json": as_json, "--html": as_html}
        written, failed = [], []
        for option, path in self._wanted():
            if path is None:
                continue
            try:
                with output(path) as stream:
                    stream.write(writers[option](sheet))
            except OSError as error:
                failed.append(f"{option} {path} could not be written: {error.strerror or error}")
            else:
                written.append(path)
        if failed:
            raise CalledWronglyError("\n".join(failed))
        return written

    def _wanted(self) -> tuple[tuple[str, Path | None], ...]:
        return (("--junit", self.junit), ("--json", self.json), ("--html", self.html))


def _check_needed(option: str) -> None:
    name = _NEEDED.get(option)
    try:
        import_module(name) if name else None
    except ModuleNotFoundError:
        raise CalledWronglyError(
            f"{option} needs {name}: run pip install 'stagewire[conformance]'"
        ) from None


_STYLES = {
    Grade.FAILED: "bold red",
    Grade.DEVIATES: "yellow",
    Grade.FRAGILE: "magenta",
    Grade.NOTED: "cyan",
}
_VERDICT_STYLES = {
    Verdict.FAILED: "bold red",
    Verdict.UNFINISHED: "bold red",
    Verdict.NON_STRICT: "yellow",
    Verdict.PARTIAL: "cyan",
    Verdict.PASSED: "green",
}
_MOST_IN_FULL = 12
"""The number of failures and deviations shown with their bytes; further ones get a line each."""


def several(only: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names and patterns of ``--only``: separated by commas, and the option may be repeated.

    Raises :class:`CalledWronglyError` for an empty name.
    """
    names = tuple(name.strip() for each in only or () for name in each.split(","))
    if "" in names:
        raise CalledWronglyError(f"--only {','.join(only or ())!r} contains an empty name")
    return names


@contextmanager
def listing() -> Iterator[None]:
    """Print a list; ignore a reader such as ``head`` that closes the pipe early."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # Rich turns a broken pipe into SystemExit
        pass


def show_results(sheet: Sheet) -> None:
    """Print a table by kind, and below it all problems and notes."""
    if not any(case.ran for case in sheet.cases()):
        return
    _show_kinds(sheet)
    out = console()
    grave = [*sheet.grave(), *sheet.cases(Grade.FRAGILE)]
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
    shown = table("kind", "description", *names.values(), right=tuple(names.values()))
    for group in sheet.groups:
        counts = group.counts()
        worst = next((grade for grade in Grade if counts[grade]), None)
        numbers = (str(counts[grade] or "") for grade in grades)
        style = _STYLES.get(worst) if worst else None
        shown.add_row(group.name, printable(group.title), *numbers, style=style)
    console().print(shown)


def _heading(sheet: Sheet, grade: Grade) -> str:
    """Return the heading of a grade: the word of its cases if they share one."""
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
        typer.echo(f"{word}: {counted(len(ids), 'check')} ({printable(why)}): {listed(ids, 3)}")


def show_end(sheet: Sheet, written: Sequence[Path]) -> None:
    """Print the written files and the result of the run; at last a warning if something may still move."""
    for path in written:
        typer.echo(f"written: {printable(str(path))}")
    console().print(
        f"{sheet.headline}: {printable(sheet.title)}: {printable(sentence(sheet))}",
        style=_VERDICT_STYLES[sheet.verdict],
        soft_wrap=True,
    )
    for text in not_at_rest(sheet):
        console().print(printable(text), style="bold red", soft_wrap=True)

"""One run of ``stagewire conformance codec``: start, ask, say, report."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import typer

from stagewire.protocols import Protocol
from stagewire_cli.conformance.files import UNFINISHED, ReportFiles, code_of
from stagewire_cli.conformance.screen import show_end, show_results
from stagewire_cli.conformance.typed import as_typed
from stagewire_cli.errors import INTERRUPTED, CalledWronglyError
from stagewire_cli.output import bar, console, printable, table
from stagewire_conformance.reports import Grade
from stagewire_conformance.reports.codec_sheet import sheet_of
from stagewire_conformance.reports.text import counted
from stagewire_conformance.testees import (
    TIMEOUT,
    ExpectedFileError,
    NotATesteeError,
    NothingToAskError,
    NotStartedError,
    Report,
    Result,
    chosen,
    read_expected,
    run,
)
from stagewire_conformance.testees.expected import not_asked
from stagewire_conformance.testees.runner import Progress, plan

__all__ = ["Asked", "run_session", "show_list"]

_EVERY = 2.0
"""Seconds between two lines that say how far it is, where there is no terminal."""


@dataclass(frozen=True)
class Asked:
    """What the options ask for.

    :param command: the testee and its arguments.
    :param named: whether the protocols were named, or are all that are installed.
    """

    command: tuple[str, ...]
    protocols: tuple[Protocol, ...]
    named: bool
    timeout: float
    expected: Path | None
    only: tuple[str, ...]
    seed: int

    def again(self, only: str) -> str:
        """Return the command that does the same again, or of it one case alone.

        :param only: the id of a case; empty for all that were chosen.
        """
        words = ["stagewire", "conformance", "codec"]
        if self.named:
            words += [word for one in self.protocols for word in ("--protocol", one.name)]
        words += ["--timeout", f"{self.timeout:g}"] if self.timeout != TIMEOUT else []
        words += ["--expected", str(self.expected)] if self.expected else []
        for pattern in [only] if only else self.only:
            words += ["--only", pattern]
        return as_typed([*words, "--seed", str(self.seed), "--", *self.command])


def show_list(asked: Asked) -> None:
    """Print the cases that would be asked.

    Raises :class:`CalledWronglyError` where there are none, and for a wrong file of expected failures.
    """
    try:
        expected = read_expected(asked.expected) if asked.expected else None
        every = plan(asked.protocols, asked.seed)
        if expected:
            expected.reasons(every, not_asked(asked.protocols))
    except ExpectedFileError as error:
        raise CalledWronglyError(str(error)) from None
    cases = chosen(every, asked.only)
    if not cases:
        raise CalledWronglyError(f"no case matches {' or '.join(asked.only)}")
    shown = table("case", "lines", "what it looks at", right=("lines",))
    for case in cases:
        shown.add_row(case.id, str(len(case.steps)), printable(case.about))
    console().print(shown)
    typer.echo(counted(len(cases), "case"))


def run_session(asked: Asked, files: ReportFiles) -> int:
    """Run the cases, print what was found, write the reports, and return the exit code.

    Raises :class:`CalledWronglyError` where nothing could be asked, and for reports that cannot be written.
    """
    try:
        expected = read_expected(asked.expected) if asked.expected else None
        with _progressing() as progress:
            report = run(
                asked.command,
                asked.protocols,
                seed=asked.seed,
                timeout=asked.timeout,
                only=asked.only,
                expected=expected,
                progress=progress,
            )
    except (NotStartedError, NothingToAskError, ExpectedFileError) as error:
        raise CalledWronglyError(str(error)) from None
    except NotATesteeError as error:
        problem = f"stagewire: {as_typed(asked.command)} is no testee: {error}"
        typer.echo("\n".join(map(printable, problem.split("\n"))), err=True)
        return UNFINISHED
    _show_testee(report)
    sheet = sheet_of(report, asked.protocols, asked.again, whole=not asked.only)
    show_results(sheet)
    if len([*sheet.cases(Grade.FAILED)]) > 1:
        typer.echo(printable(f"any of them again, with what was said: {asked.again('ID')}"))
    if report.unfinished:
        typer.echo(printable(f"not finished: {report.unfinished}"), err=True)
    show_end(sheet, files.write(sheet))
    return INTERRUPTED if report.interrupted else code_of(sheet)


def _show_testee(report: Report) -> None:
    hello = report.hello
    typer.echo(
        printable(
            f"{hello.implementation} {hello.version} speaks {', '.join(hello.protocols)} and can "
            f"{', '.join(hello.operations)}; {counted(len(report.results), 'case')}, seed {report.seed}, "
            f"started {counted(report.starts, 'time')}, {report.seconds:.1f} s"
        )
    )


@contextmanager
def _progressing() -> Iterator[Progress]:
    """Give what hears of each case: a bar on a terminal, a line from time to time elsewhere."""
    if not sys.stderr.isatty():
        yield _Lines()
        return
    with bar("starting the testee") as show:
        failed = 0

        def hear(done: int, total: int, result: Result) -> None:
            nonlocal failed
            failed += result.failed
            show(done, total, _state(result, failed))

        yield hear


class _Lines:
    """Says from time to time how far it is."""

    def __init__(self) -> None:
        self._next = time.monotonic() + _EVERY
        self._failed = 0

    def __call__(self, done: int, total: int, result: Result) -> None:
        """Hear of a case."""
        self._failed += result.failed
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + _EVERY
            state = _state(result, self._failed)
            print(f"... {done} of {total}: {state}", file=sys.stderr, flush=True)


def _state(result: Result, failed: int) -> str:
    return f"{result.case.group}, {failed} failed" if failed else result.case.group

"""``stagewire conformance codec``: check a codec in any language against the documents."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.conformance.sheets import (
    Html,
    Json,
    Junit,
    ReportFiles,
    listing,
    several,
    show_end,
    show_results,
)
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import bar, console, printable, table
from stagewire_cli.protocols import one_or_all
from stagewire_conformance.notation import as_typed
from stagewire_conformance.reports import Grade, Verdict
from stagewire_conformance.reports.codec_sheet import sheet_of, testee_line
from stagewire_conformance.reports.text import counted
from stagewire_conformance.testees import (
    ExpectedFileError,
    NotATesteeError,
    NothingToAskError,
    NotStartedError,
    Plan,
    Result,
)
from stagewire_conformance.testees.runner import Progress

"""Seconds between two lines of progress without a terminal."""

_LONGEST = 86_400
"""The longest timeout in seconds."""

EXAMPLE = """\b
Examples:
  stagewire conformance codec -- stagewire testee
  stagewire conformance codec --protocol thorlabs_apt --html report.html -- ./testee --quiet
  stagewire conformance codec --expected expected.toml --junit report.xml -- java -jar testee.jar
  stagewire conformance codec --only MOT_SET_VELPARAMS,MOT_MOVE_HOME -- ./testee
  stagewire conformance codec --only 'thorlabs_apt/cut/*' --list
\b
Exit status:
  0    all cases passed, or failed as expected
  1    a case failed, or a case that was expected to fail passed
  2    invalid arguments: an unknown program, protocol or case, or an invalid file of expected failures
  4    not finished: the program does not answer hello as a testee, or was restarted too often
  130  interrupted
"""


def codec(
    command: Annotated[
        list[str] | None,
        typer.Argument(metavar="COMMAND...", help="The testee and its arguments, after --."),
    ] = None,
    protocol: Annotated[
        list[str] | None,
        typer.Option(
            "--protocol", metavar="NAME", help="Test only this protocol; may be repeated."
        ),
    ] = None,
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="SECONDS", help="Time limit for each answer.")
    ] = 5.0,
    expected: Annotated[
        Path | None,
        typer.Option(
            "--expected", metavar="FILE", help="Cases that are known to fail, with reasons (TOML)."
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAMES",
            help="Run only cases of these ids, groups (both with * and ?) or messages, separated by commas; "
            "may be repeated.",
        ),
    ] = None,
    list_cases: Annotated[bool, typer.Option("--list", help="List the cases and exit.")] = False,
    seed: Annotated[
        int,
        typer.Option(
            "--seed",
            metavar="NUMBER",
            help="Seed of random choices; the same seed sends the same lines.",
        ),
    ] = 1,
    junit: Junit = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Test a codec against every example and every case of the registry.

    COMMAND is a program that reads requests from standard input, one JSON object per line, and answers each
    of them; docs/reference/codec-conformance.md describes the protocol. The run covers every example of the
    documents, every case of the registry, streams cut at every byte, and invalid requests. If the program
    crashes or does not answer, it is restarted and the run continues.
    """
    files = ReportFiles(junit, json, html, others=(("--expected", expected),))
    files.check()
    if not 0 < timeout <= _LONGEST:
        raise CalledWronglyError(
            f"--timeout must be a number of seconds above 0 and at most {_LONGEST}, not {timeout:g}"
        )
    names: list[str | None] = [*dict.fromkeys(protocol or [])]
    protocols = [one for name in names or [None] for one in one_or_all(name, whole=True)]
    plan = Plan(
        command=tuple(command or ()),
        protocols=tuple(protocols),
        named=bool(names),
        timeout=timeout,
        expected=expected,
        only=several(only),
        seed=seed,
    )
    if list_cases:
        with listing():
            _show_list(plan)
        return
    if not command:
        raise CalledWronglyError("missing testee: give its command after --, such as -- ./testee")
    code = _run(plan, files)
    if code:
        raise typer.Exit(code)


def _show_list(plan: Plan) -> None:
    """Print the cases that would be run."""
    try:
        cases = plan.cases()
    except (NothingToAskError, ExpectedFileError) as error:
        raise CalledWronglyError(str(error)) from None
    shown = table("case", "lines", "description", right=("lines",))
    for case in cases:
        shown.add_row(case.id, str(len(case.steps)), printable(case.about))
    console().print(shown)
    typer.echo(counted(len(cases), "case"))


def _run(plan: Plan, files: ReportFiles) -> int:
    """Run the cases, print the results, write the reports, and return the exit status."""
    try:
        with _progress_display() as progress:
            report = plan.run(progress)
    except (NotStartedError, NothingToAskError, ExpectedFileError) as error:
        raise CalledWronglyError(str(error)) from None
    except NotATesteeError as error:
        problem = f"stagewire: {as_typed(plan.command)} is not a testee: {error}"
        typer.echo("\n".join(map(printable, problem.split("\n"))), err=True)
        return Verdict.UNFINISHED.exit_status
    typer.echo(printable(testee_line(report)))
    sheet = sheet_of(report, plan.protocols, plan.repeat)
    show_results(sheet)
    if len([*sheet.cases(Grade.FAILED)]) > 1:
        typer.echo(printable(f"to repeat one of them and show its dialogue: {plan.repeat('ID')}"))
    if report.unfinished:
        typer.echo(printable(f"not finished: {report.unfinished}"), err=True)
    show_end(sheet, files.write(sheet))
    return sheet.exit_status


@contextmanager
def _progress_display() -> Iterator[Progress]:
    """Yield a callback that shows progress as a bar."""
    with bar("starting the testee") as show:
        failed = 0

        def hear(done: int, total: int, result: Result) -> None:
            nonlocal failed
            failed += result.failed
            show(done, total, _state(result, failed))

        yield hear


def _state(result: Result, failed: int) -> str:
    return f"{result.case.group}, {failed} failed" if failed else result.case.group

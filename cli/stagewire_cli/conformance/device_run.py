"""A run of ``stagewire conformance device``: plan, announcement, progress and results."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import typer

from stagewire.errors import LinkOpenError, StagewireError
from stagewire_cli.conformance.sheets import ReportFiles, show_end, show_results
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import bar, console, printable, table
from stagewire_cli.stages import own_stages
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.errors import NothingToRunError
from stagewire_conformance.device.execution import execute, verify
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.reports.device_sheet import sheet_of_execution
from stagewire_conformance.reports.device_text import announcement, ending, needs_text, pages_text
from stagewire_conformance.reports.text import counted


def plan_of(
    unit: str | None,
    pics: Path | None,
    *,
    motion: str | None,
    granted: Mapping[str, bool],
    only: Sequence[str],
    seed: int,
    stages: Path | None,
) -> Plan:
    """Return the plan for the options; raise :class:`CalledWronglyError` if they are invalid.

    :param granted: the other permissions, by their names in :class:`.Permissions`.
    """
    try:
        span = Range.parse(motion) if motion else None
    except StagewireError as error:
        raise CalledWronglyError(f"--allow-motion: {error}") from None
    allowed = Permissions(motion=span, **granted)
    try:
        own = own_stages(stages if pics is not None else None)
        return Plan.of(unit, allowed, pics=pics, only=only, seed=seed, own_stages=own)
    except StagewireError as error:
        raise CalledWronglyError(str(error)) from None


def show_list(plan: Plan) -> None:
    """Print every check with what it needs, and the pages of the document about it."""
    shown = table("check", "needs", "document", "requirement")
    for check in plan.checks:
        shown.add_row(check.id, needs_text(check), pages_text(plan, check), printable(check.title))
    console().print(shown)
    typer.echo(f"{plan.declared.unit.name}: {counted(len(plan.checks), 'check')}")


def run_session(url: str, plan: Plan, files: ReportFiles, log: Path | None) -> int:
    """Run the checks, write the reports, print the results, and return the exit status.

    Raises :class:`CalledWronglyError` if nothing can be run, and for reports that cannot be written.
    """
    try:
        verify(url, plan)
    except (NothingToRunError, LinkOpenError) as error:
        raise CalledWronglyError(str(error)) from None
    for text in announcement(url, plan):
        typer.echo(printable(text))
    execution = execute(url, plan, log=log, progress=_progress_display)
    sheet = sheet_of_execution(execution)
    written = [] if execution.capture is None else [execution.capture]
    try:
        written += files.write(sheet)
    finally:
        with suppress(BrokenPipeError):  # a closed pipe does not change the exit status
            show_results(sheet)
            if execution.report.unfinished:
                _show_ending(execution.report)
            show_end(sheet, written)
    return sheet.exit_status


@contextmanager
def _progress_display() -> Iterator[Callable[[Check, int, int], None]]:
    """Yield a callback that shows progress as a bar."""
    with bar("querying the controller") as show:
        yield lambda check, before, total: show(before, total, check.id)


def _show_ending(report: Report) -> None:
    """Print why a run ended early, which stops were sent, and which settings were restored."""
    typer.echo(f"stagewire: {printable(report.unfinished)}", err=True)
    if report.defect is not None:
        traceback.print_exception(report.defect)  # a bug in stagewire, which needs its traceback
    for text in ending(report):
        typer.echo(printable(text), err=True)

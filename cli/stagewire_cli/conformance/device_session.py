"""One run of ``stagewire conformance device``: open, say, run, report."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from stagewire.errors import LinkOpenError, TransportError
from stagewire.links import open_link
from stagewire_cli.conformance.device_plan import Planned
from stagewire_cli.conformance.device_screen import progressing, show_beginning, show_cut_short
from stagewire_cli.conformance.files import ReportFiles, code_of
from stagewire_cli.conformance.recorded import recorded
from stagewire_cli.conformance.screen import show_end, show_results
from stagewire_cli.errors import INTERRUPTED, CalledWronglyError
from stagewire_conformance.device.digests import digests_of
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_conformance.reports.device_sheet import sheet_of

__all__ = ["run_session"]


def run_session(url: str, planned: Planned, files: ReportFiles, log: Path | None) -> int:
    """Run the checks, write the reports, print what was found, and return the exit code.

    Raises :class:`CalledWronglyError` where nothing could be run, and for reports that cannot be written.
    """
    if not planned.runnable:
        raise CalledWronglyError(_nothing(planned))
    _check_virtual(url)
    show_beginning(url, planned)
    began = time.monotonic()
    interrupted = False
    written: list[Path] = []
    try:
        report = _run(url, planned, log, written)
    except RunInterrupted as error:
        interrupted = True
        report = error.report
    except KeyboardInterrupt as error:
        interrupted = True
        # Interrupted once more, while the line was closed behind the stops, or before anything was sent.
        before = error.__context__
        report = (
            before.report
            if isinstance(before, RunInterrupted)
            else _dead(url, planned, "it was interrupted before it began")
        )
    sheet = sheet_of(
        report,
        planned.checks,
        time.monotonic() - began,
        _again(url, planned),
        whole=not planned.only,
    )
    try:
        written += files.write(sheet)
    finally:
        with suppress(BrokenPipeError):  # nobody reads it any more; the exit code stands
            show_results(sheet)
            if report.unfinished:
                show_cut_short(report)
            show_end(sheet, written)
    return INTERRUPTED if interrupted else code_of(sheet)


def _check_virtual(url: str) -> None:
    """Raise :class:`CalledWronglyError` for a URL that describes no virtual controller, but should."""
    if url.lower().startswith("virtual://"):
        from stagewire_virtual.linking import blueprint_of

        try:
            blueprint_of(url)
        except LinkOpenError as error:
            raise CalledWronglyError(str(error)) from None


def _run(url: str, planned: Planned, log: Path | None, written: list[Path]) -> Report:
    """Open the line and run; a line that is dead gives a report in which nothing was run.

    :param written: takes the log when it has been begun.
    """
    declared = planned.declared
    try:
        with (
            open_link(url) as link,
            recorded(link, log, declared.protocol, declared.unit.name) as line,
            progressing() as progress,
        ):
            written += [] if log is None else [log]
            return run(line, planned.checks, declared, planned.allowed, planned.seed, progress)
    except (NothingAnswersError, TransportError) as error:
        return _dead(url, planned, str(error))


def _dead(url: str, planned: Planned, why: str) -> Report:
    """Return the report of a run that did not begin."""
    return Report(
        declared=planned.declared,
        url=url,
        seed=planned.seed,
        allowed=planned.allowed,
        outcomes=(),
        not_run=tuple(
            (check, planned.refusal(check) or "nothing was run") for check in planned.checks
        ),
        unfinished=why,
        jitter=0.0,
        started=datetime.now(UTC),
        digests=digests_of(planned.declared),
        identification={},
    )


def _again(url: str, planned: Planned) -> Callable[[str], str]:
    return lambda only: planned.again(url, only)


def _nothing(planned: Planned) -> str:
    """Return why a run would be empty, and what would fill it."""
    reasons = dict.fromkeys(planned.refusal(check) or check.skip for check in planned.checks)
    return f"there is nothing to run; all that was chosen is left out: {'; '.join(reasons)}"

"""Execute a plan at a URL: open the line, record it if requested, run the checks, close it.

::

    plan = Plan.of("TDC001", Permissions())
    execution = execute("/dev/ttyUSB0", plan)
    sheet = sheet_of_execution(execution)
    print(sheet.verdict, sheet.exit_status)

If the line cannot be opened, or if the controller does not answer, the result is a report without outcomes
that states the reason.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from stagewire.errors import TransportError
from stagewire.links import Link
from stagewire.protocols import CommandProtocol, FramedProtocol
from stagewire.sessions import Recording
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.lines.reopening import Reopenable, ReopeningLink
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.report import Report, digests_of
from stagewire_conformance.device.run import Progress, RunInterrupted, run


@dataclass(frozen=True, kw_only=True)
class Execution:
    """A plan that was executed, completely or in part.

    :param url: the URL as given by the caller. The URL in the report is that of the link.
    :param seconds: the duration, including opening and closing the line.
    :param interrupted: whether Ctrl-C or SIGTERM ended the run.
    :param capture: the file with the recorded traffic; None if the line was not recorded.
    """

    plan: Plan
    url: str
    report: Report
    seconds: float
    interrupted: bool = False
    capture: Path | None = None


def verify(url: str, plan: Plan) -> None:
    """Check that a plan can be executed at a URL, before anything is opened.

    Raises :class:`.NothingToRunError` if every check is omitted, and :class:`~stagewire.errors.LinkOpenError`
    for an invalid URL of a virtual controller.
    """
    plan.verify()
    if url.lower().startswith("virtual://"):
        from stagewire_virtual.linking import blueprint_of  # for these URLs alone

        blueprint_of(url)


def _quiet(check: Check, before: int, total: int) -> None:
    """Ignore progress."""


def execute(
    url: str,
    plan: Plan,
    *,
    log: Path | None = None,
    progress: Callable[[], AbstractContextManager[Progress]] = lambda: nullcontext(_quiet),
) -> Execution:
    """Open a line, run a plan on it, and return the results, however the run ended.

    :param log: the file for a capture of the traffic.
    :param progress: a context manager that is entered after the line is opened and left before it is closed.
        It yields a function that is called before each check.

    Raises the same errors as :func:`verify`. Ctrl-C and SIGTERM end the run without an exception.
    """
    verify(url, plan)
    began = time.monotonic()
    interrupted = False
    captures: list[Path] = []
    try:
        report = _run(url, plan, log, captures, progress)
    except RunInterrupted as error:
        interrupted = True
        report = error.report
    except KeyboardInterrupt as error:
        interrupted = True
        # Interrupted a second time: while the line was closed after the stops, or before anything was sent.
        before = error.__context__
        report = (
            before.report
            if isinstance(before, RunInterrupted)
            else dead_line_report(url, plan, "interrupted before it began")
        )
    return Execution(
        plan=plan,
        url=url,
        report=report,
        seconds=time.monotonic() - began,
        interrupted=interrupted,
        capture=next(iter(captures), None),
    )


def _run(
    url: str,
    plan: Plan,
    log: Path | None,
    captures: list[Path],
    progress: Callable[[], AbstractContextManager[Progress]],
) -> Report:
    """Open the line and run. For a dead line return a report without outcomes.

    :param captures: the log file is added here once it has been created.
    """
    try:
        with (
            ReopeningLink(url) as link,
            _recorded(link, log, plan) as line,
            progress() as hear,
        ):
            captures += [] if log is None else [log]
            return run(line, plan.checks, plan.declared, plan.allowed, plan.seed, hear)
    except (NothingAnswersError, TransportError) as error:
        return dead_line_report(url, plan, str(error))


def dead_line_report(url: str, plan: Plan, why: str) -> Report:
    """Return the report of a run that did not begin because its line was dead.

    :param why: the reason, for example that the controller did not answer.
    """
    return Report(
        declared=plan.declared,
        url=url,
        seed=plan.seed,
        allowed=plan.allowed,
        outcomes=(),
        not_run=tuple(
            (check, check.refusal(plan.allowed) or "nothing was run") for check in plan.checks
        ),
        unfinished=why,
        jitter=0.0,
        started=datetime.now(UTC),
        digests=digests_of(plan.declared),
        identification={},
    )


class _RecordedLink(Reopenable):
    """A link that records all traffic.

    :param link: the underlying link.
    """

    def __init__(self, link: Link, recording: Recording) -> None:
        self.url = link.url
        self.clock = link.clock
        self._link = link
        self._recording = recording

    def read(self, timeout: float) -> bytes:
        """Read, and record the received bytes."""
        data = self._link.read(timeout)
        if data:
            self._recording.received(data)
        return data

    def write(self, data: bytes) -> None:
        """Record the bytes, and write them."""
        self._recording.sent(data)
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        """Write immediately, without recording."""
        self._link.write_now(data)

    def reopen(self) -> bool:
        """Open the underlying link again, if it can be."""
        return isinstance(self._link, Reopenable) and self._link.reopen()

    def wake(self) -> None:
        """Make a waiting read return soon."""
        self._link.wake()

    def close(self) -> None:
        """Close the link. The recording is closed by its owner."""
        self._link.close()


@contextmanager
def _recorded(link: Link, path: Path | None, plan: Plan) -> Iterator[Link]:
    """Yield a link that is recorded until the block ends, or the link itself if there is no path.

    Raises :class:`~stagewire.errors.TransportError` if the file cannot be written.
    """
    if path is None:
        yield link
        return
    protocol = plan.declared.protocol
    assert isinstance(protocol, FramedProtocol | CommandProtocol)  # the suite supports no others
    recording = Recording(path, protocol, link.clock or time.monotonic, plan.declared.unit.name)
    try:
        yield _RecordedLink(link, recording)
    finally:
        recording.close()

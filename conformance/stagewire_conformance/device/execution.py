"""The execution of a plan at a URL: the line is opened, recorded where that is wanted, checked and closed.

::

    plan = Plan.of("TDC001", Permissions())
    execution = execute("/dev/ttyUSB0", plan)
    sheet = sheet_of_execution(execution)
    print(sheet.verdict, sheet.exit_status)

A line that cannot be opened, or on which nothing answers, gives a report as well: nothing was run, and the
report says why.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from stagewire.errors import TransportError
from stagewire.links import Link, open_link
from stagewire.protocols import CommandProtocol, FramedProtocol
from stagewire.sessions import Recording
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.report import Report, digests_of
from stagewire_conformance.device.run import Progress, RunInterrupted, run


@dataclass(frozen=True, kw_only=True)
class Execution:
    """A plan that was carried out, as far as it went.

    :param url: where it was carried out, as it was given; that of the report is the link's own.
    :param seconds: how long it took, with opening and closing the line.
    :param interrupted: whether it was ended by Ctrl-C or SIGTERM.
    :param capture: the file in which the line was recorded; None: it was not recorded.
    """

    plan: Plan
    url: str
    report: Report
    seconds: float
    interrupted: bool = False
    capture: Path | None = None


def verify(url: str, plan: Plan) -> None:
    """Check, before anything is opened, that a plan can be carried out at a URL.

    Raises :class:`.NothingToRunError` where every check is left out, and
    :class:`~stagewire.errors.LinkOpenError` for a URL that should describe a virtual controller and does not.
    """
    plan.verify()
    if url.lower().startswith("virtual://"):
        from stagewire_virtual.linking import blueprint_of  # for these URLs alone

        blueprint_of(url)


def _quiet(check: Check, before: int, total: int) -> None:
    """Hear of a check, and say nothing."""


def execute(
    url: str,
    plan: Plan,
    *,
    log: Path | None = None,
    progress: Callable[[], AbstractContextManager[Progress]] = lambda: nullcontext(_quiet),
) -> Execution:
    """Open a line, run a plan on it, and return what was found, however the run ended.

    :param log: where the line is recorded, as a capture.
    :param progress: opened when the line is open, and closed before it; it gives a function that hears of
        each check.

    Raises what :func:`verify` raises. Ctrl-C and SIGTERM end the run, and raise nothing.
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
        # Interrupted once more, while the line was closed after the stops, or before anything was sent.
        before = error.__context__
        report = (
            before.report
            if isinstance(before, RunInterrupted)
            else dead_line_report(url, plan, "it was interrupted before it began")
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
    """Open the line and run; a dead line gives a report in which nothing was run.

    :param captures: takes the log when it has been begun.
    """
    try:
        with (
            open_link(url) as link,
            _recorded(link, log, plan) as line,
            progress() as hear,
        ):
            captures += [] if log is None else [log]
            return run(line, plan.checks, plan.declared, plan.allowed, plan.seed, hear)
    except (NothingAnswersError, TransportError) as error:
        return dead_line_report(url, plan, str(error))


def dead_line_report(url: str, plan: Plan, why: str) -> Report:
    """Return the report of a run that did not begin, because its line was dead.

    :param why: such as what could not be opened, or that nothing answered.
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


class _RecordedLink(Link):
    """A link of which everything is recorded.

    :param link: what does the work.
    """

    def __init__(self, link: Link, recording: Recording) -> None:
        self.url = link.url
        self.clock = link.clock
        self._link = link
        self._recording = recording

    def read(self, timeout: float) -> bytes:
        """Read, and record what came."""
        data = self._link.read(timeout)
        if data:
            self._recording.received(data)
        return data

    def write(self, data: bytes) -> None:
        """Record, and write."""
        self._recording.sent(data)
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        """Write without waiting for anything, the recording included."""
        self._link.write_now(data)

    def wake(self) -> None:
        """Let a read that waits return soon."""
        self._link.wake()

    def close(self) -> None:
        """Close the link; the recording is closed by the code that made it."""
        self._link.close()


@contextmanager
def _recorded(link: Link, path: Path | None, plan: Plan) -> Iterator[Link]:
    """Give a link that is recorded until the block ends; the link itself without a path.

    Raises :class:`~stagewire.errors.TransportError` for a file that cannot be written.
    """
    if path is None:
        yield link
        return
    protocol = plan.declared.protocol
    assert isinstance(protocol, FramedProtocol | CommandProtocol)  # the suite knows no others
    recording = Recording(path, protocol, link.clock or time.monotonic, plan.declared.unit.name)
    try:
        yield _RecordedLink(link, recording)
    finally:
        recording.close()

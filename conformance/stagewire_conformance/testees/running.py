"""Tests a testee: asks it all cases, and keeps what it found, however it ends."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from datetime import UTC, datetime

from stagewire.protocols import Protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testees.case import Case
from stagewire_conformance.testees.errors import NothingToAskError
from stagewire_conformance.testees.expected import Expected, not_asked
from stagewire_conformance.testees.explain import shortened
from stagewire_conformance.testees.hello import Hello
from stagewire_conformance.testees.plan import chosen, plan, why_not
from stagewire_conformance.testees.process import Process
from stagewire_conformance.testees.result import Report, Result
from stagewire_conformance.testees.session import GivenUpError, Line, Session

__all__ = ["TIMEOUT", "Progress", "run"]

TIMEOUT = 5.0
"""Seconds that an answer may take where nobody says otherwise."""

Progress = Callable[[int, int, Result], None]
"""Called after each case with how many are done, how many there are, and what became of it."""


def run(
    command: Sequence[str],
    protocols: Sequence[Protocol],
    *,
    seed: int = 1,
    timeout: float = TIMEOUT,
    only: Collection[str] = (),
    expected: Expected | None = None,
    progress: Progress | None = None,
    start: Callable[[], Line] | None = None,
) -> Report:
    """Start a testee, and ask it the cases of protocols.

    :param command: the program and its arguments.
    :param seed: what decides whatever chance decides.
    :param timeout: seconds that an answer may take.
    :param only: patterns of ids, groups or messages; without any, all cases are asked.
    :param expected: the cases that are known to fail.
    :param start: starts the testee, in the place of ``command``.

    Raises :class:`NotStartedError` where it cannot be started, :class:`NotATesteeError` where it does not
    answer ``hello``, :class:`NothingToAskError` where it speaks none of the protocols or no case is
    chosen, :class:`ExpectedFileError` where an expected failure is of no case. What goes wrong later is in
    the report.
    """
    session = Session(start or (lambda: Process(command)), timeout)
    started, began = datetime.now(UTC), time.monotonic()
    with contextlib.closing(session):
        hello = session.hello()
        _spoken(protocols, hello)
        every = plan(protocols, seed, hello)
        reasons = expected.reasons(every, not_asked(protocols)) if expected else {}
        cases = chosen(every, only)
        if not cases:
            raise NothingToAskError(f"no case matches {' or '.join(only)}")
        results: dict[str, Result] = {}
        unfinished, interrupted = "", False
        try:
            for result in _asked(session, hello, cases):
                id = result.case.id
                results[id] = dataclasses.replace(result, expected=reasons.get(id, ""))
                if progress:
                    progress(len(results), len(cases), results[id])
        except GivenUpError as error:
            unfinished = str(error)
        except KeyboardInterrupt:
            unfinished, interrupted = "interrupted", True
    return Report(
        command=tuple(command),
        hello=hello,
        results=tuple(results.values()),
        not_run=tuple(cases[len(results) :]),
        unfinished=unfinished,
        interrupted=interrupted,
        starts=session.starts,
        seed=seed,
        timeout=timeout,
        started=started,
        seconds=time.monotonic() - began,
    )


def _spoken(protocols: Sequence[Protocol], hello: Hello) -> None:
    asked = [protocol.name for protocol in protocols]
    if not set(asked).intersection(hello.protocols):
        speaks = ", ".join(hello.protocols) or "no protocol"
        raise NothingToAskError(f"the testee speaks {speaks}, and not {' or '.join(asked)}")


def _asked(session: Session, hello: Hello, cases: Sequence[Case]) -> Iterator[Result]:
    """Yield a result for each case, and another one where something came behind its answers."""
    last: Result | None = None
    for case in cases:
        if why := why_not(case, hello):
            yield Result(case=case, outcome=Outcome.SKIPPED, text=why)
            continue
        yield from _too_much(session, last)
        last = session.ask(case)
        yield last
    yield from _too_much(session, last)


def _too_much(session: Session, last: Result | None) -> Iterator[Result]:
    came = session.unasked()
    if came and last and last.outcome is Outcome.PASSED:
        shown = shortened(came.decode("utf-8", errors="replace").rstrip("\r\n"))
        text = f"another line came behind the answer: {shown!r}"
        yield dataclasses.replace(last, outcome=Outcome.RUBBISH, text=text, came=came.rstrip())

"""Plan the cases for a testee, run them in order, and keep the results, however the run ends.

:func:`plan` makes the cases, :func:`run` asks them. A :class:`Plan` has all that a run depends on, and the
command that repeats it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fnmatch
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from stagewire.protocols import Protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.notation import as_typed
from stagewire_conformance.testees.case import Case, NothingToAskError, Step, ask
from stagewire_conformance.testees.expected import Expected, other_protocols, read_expected
from stagewire_conformance.testees.explanation import shortened
from stagewire_conformance.testees.hostile import damaged_cases, id_cases, line_cases, order_cases
from stagewire_conformance.testees.process import Process
from stagewire_conformance.testees.registry_cases import (
    OPERATIONS,
    cut_cases,
    example_cases,
    large_cases,
    stated_cases,
)
from stagewire_conformance.testees.result import Hello, Report, Result
from stagewire_conformance.testees.session import GivenUpError, Program, Session

GROUPS = {
    "examples": "Worked examples of the document",
    "captures": "Captures of third parties",
    "cases": "Cases of the registry",
    "cut": "Streams, cut at every place",
    "large": "Requests larger than any frame",
    "lines": "Hostile and unusual lines",
    "order": "Many lines at once",
}
"""Last part of the name of a group -> what its cases are."""


def plan(protocols: Iterable[Protocol], seed: int, hello: Hello | None = None) -> list[Case]:
    """Return the cases of the protocols, then those that look at lines alone.

    :param seed: what chance decides follows from it.
    :param hello: what the testee can do; what it has not got is planned, and left out when it is run.
    """
    made: list[Case] = []
    for protocol in protocols:
        for part in (example_cases, stated_cases, cut_cases, large_cases):
            made += part(protocol)
    can = [case for case in made if not why_not(case, hello)]
    clean = _clean(can)
    seldom = [*line_cases(clean), *id_cases(clean)]
    return [*made, *seldom, *damaged_cases(clean, seed), *order_cases([*can, *seldom], seed)]


def chosen(cases: Sequence[Case], only: Collection[str]) -> list[Case]:
    """Return the cases whose id, group or message one of the patterns matches; all without a pattern."""
    if not only:
        return list(cases)
    return [
        case
        for case in cases
        for names in [(case.id, case.group, case.message)]
        if any(fnmatch.fnmatchcase(name, pattern) for name in names for pattern in only)
    ]


def _some(cases: Sequence[Case], only: Collection[str]) -> list[Case]:
    """Return the cases of :func:`chosen`; raises :class:`NothingToAskError` for none."""
    found = chosen(cases, only)
    if not found:
        raise NothingToAskError(f"no case matches {' or '.join(only)}")
    return found


def why_not(case: Case, hello: Hello | None) -> str:
    """Return why a testee cannot be asked a case; empty where it can."""
    if hello is None:
        return ""
    if case.protocol and case.protocol not in hello.protocols:
        return f"the testee does not speak {case.protocol}"
    lacking = sorted(case.operations.difference(hello.operations))
    return f"the testee does not {' and '.join(lacking)}" if lacking else ""


def _clean(cases: Iterable[Case]) -> list[Step]:
    """Return a request for each protocol and operation that is granted; at least one."""
    found: dict[tuple[str, str], Step] = {}
    for case in cases:
        step = case.steps[0]
        for operation in case.operations:
            if step.wanted.get("ok"):
                found.setdefault((case.protocol, operation), step)
    ordered = sorted(found, key=lambda key: OPERATIONS.index(key[1]))
    return [found[key] for key in ordered] or [ask({"op": "hello"}, {})]


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
    start: Callable[[], Program] | None = None,
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
        reasons = expected.reasons(every, other_protocols(protocols)) if expected else {}
        cases = _some(every, only)
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
    came = session.unsolicited()
    if came and last and last.outcome is Outcome.PASSED:
        shown = shortened(came.decode("utf-8", errors="replace").rstrip("\r\n"))
        text = f"another line came behind the answer: {shown!r}"
        yield dataclasses.replace(last, outcome=Outcome.RUBBISH, text=text, came=came.rstrip())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plan:
    """A run against a testee that has not begun.

    :param command: the program and its arguments.
    :param protocols: those whose cases are asked.
    :param named: whether the protocols were chosen by name, or are all that are installed.
    :param timeout: seconds that an answer may take.
    :param expected: the file of the cases that are known to fail.
    :param only: patterns of ids, groups or messages; without any, all cases are asked.
    :param seed: what decides whatever chance decides.
    """

    command: tuple[str, ...]
    protocols: tuple[Protocol, ...]
    named: bool = False
    timeout: float = TIMEOUT
    expected: Path | None = None
    only: tuple[str, ...] = ()
    seed: int = 1

    def cases(self) -> list[Case]:
        """Return the cases that will be asked, without starting the testee.

        Raises :class:`NothingToAskError` where there are none, and :class:`ExpectedFileError` for a file that
        cannot be used.
        """
        expected = read_expected(self.expected) if self.expected else None
        every = plan(self.protocols, self.seed)
        if expected:
            expected.reasons(every, other_protocols(self.protocols))
        return _some(every, self.only)

    def run(self, progress: Progress | None = None) -> Report:
        """Start the testee, and ask it the cases; raises what :func:`run` raises."""
        return run(
            self.command,
            self.protocols,
            seed=self.seed,
            timeout=self.timeout,
            only=self.only,
            expected=read_expected(self.expected) if self.expected else None,
            progress=progress,
        )

    def repeat(self, only: str = "") -> str:
        """Return the command that repeats the run, or one case of it.

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

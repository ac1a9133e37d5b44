"""Plan the cases for a testee, run them in order, and keep the results, however the run ends.

:func:`plan` makes the cases and :func:`run` runs them. A :class:`Plan` has everything that a run depends on,
and the command that repeats it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import fnmatch
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from stagewire.protocols import Protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.notation import as_typed
from stagewire_conformance.registry import registry_of
from stagewire_conformance.testees.case import Case, NotATesteeError, NothingToAskError, Step, ask
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
    "cut": "Streams, split and byte by byte",
    "large": "Requests larger than any frame",
    "lines": "Hostile and unusual lines",
    "order": "Many lines at once",
}
"""Last part of the name of a group -> title of the group."""


def plan(protocols: Iterable[Protocol], seed: int, hello: Hello | None = None) -> list[Case]:
    """Return the cases of the protocols, then those about lines only.

    :param seed: the seed of all random choices.
    :param hello: the abilities of the testee. Cases that it does not support are planned, but skipped in a
        run.
    """
    made: list[Case] = []
    for protocol in protocols:
        for part in (example_cases, stated_cases, cut_cases):
            made += part(protocol)
        made += large_cases(protocol, lambda case: not why_not(case, hello))
    can = [case for case in made if not why_not(case, hello)]
    clean = _clean(can)
    seldom = [*line_cases(clean), *id_cases(clean)]
    return [*made, *seldom, *damaged_cases(clean, seed), *order_cases([*can, *seldom], seed)]


def chosen(cases: Sequence[Case], only: Collection[str]) -> list[Case]:
    """Return the cases whose id, group or message matches one of the patterns; all without a pattern."""
    if not only:
        return list(cases)
    return [
        case
        for case in cases
        for names in [(case.id, case.group, case.message)]
        if any(fnmatch.fnmatchcase(name, pattern) for name in names for pattern in only)
    ]


def _some(cases: Sequence[Case], only: Collection[str]) -> list[Case]:
    """Return the cases of :func:`chosen`.

    Raises :class:`NothingToAskError` for a pattern that matches none.
    """
    for pattern in only:
        if not chosen(cases, [pattern]):
            raise NothingToAskError(f"no case matches {pattern or repr(pattern)}")
    return chosen(cases, only)


def why_not(case: Case, hello: Hello | None) -> str:
    """Return why a testee does not support a case, or an empty string."""
    if hello is None:
        return ""
    if case.protocol and case.protocol not in hello.protocols:
        return f"the testee does not support {case.protocol}"
    lacking = sorted(case.operations.difference(hello.operations))
    if lacking:
        return f"the testee does not support {' and '.join(lacking)}"
    return _NOT_IMPLEMENTED if hello.lacks(case.protocol, case.needs) else ""


_NOT_IMPLEMENTED = "about messages that the testee does not implement"


def _clean(cases: Iterable[Case]) -> list[Step]:
    """Return a valid request for each protocol and operation; at least one."""
    found: dict[tuple[str, str], Step] = {}
    for case in cases:
        step = case.steps[0]
        for operation in case.operations:
            if step.wanted.get("ok"):
                found.setdefault((case.protocol, operation), step)
    ordered = sorted(found, key=lambda key: OPERATIONS.index(key[1]))
    return [found[key] for key in ordered] or [ask({"op": "hello"}, {})]


TIMEOUT = 5.0
"""Default timeout of an answer in seconds."""

Progress = Callable[[int, int, Result], None]
"""Called after each case with the number of finished cases, the total, and the result."""


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
    """Start a testee, and run the cases of some protocols.

    :param command: the program and its arguments.
    :param seed: the seed of all random choices.
    :param timeout: seconds within which an answer must arrive.
    :param only: patterns of ids, groups or messages; empty for all cases.
    :param expected: the expected failures.
    :param start: starts the testee, instead of ``command``.

    Raises :class:`NotStartedError` if it cannot be started, :class:`NotATesteeError` if it does not answer
    ``hello``, :class:`NothingToAskError` if it supports none of the protocols or if no case is selected, and
    :class:`ExpectedFileError` if an expected failure matches no case. Later errors are stated in the report.
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
        unselected=len(every) - len(cases),
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
        raise NothingToAskError(f"the testee supports {speaks}, but not {' or '.join(asked)}")
    for protocol in protocols:
        known = registry_of(protocol).messages
        for name in sorted(hello.messages.get(protocol.name, frozenset()) - known.keys()):
            close = difflib.get_close_matches(name[:80], known, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            raise NotATesteeError(
                f"messages in its answer to hello: {protocol.name} has no message {name!r}{hint}"
            )


def _asked(session: Session, hello: Hello, cases: Sequence[Case]) -> Iterator[Result]:
    """Yield a result for each case, and another one if there was a line after its answers."""
    last: Result | None = None
    for case in cases:
        if why := why_not(case, hello):
            lacks = why == _NOT_IMPLEMENTED
            outcome = Outcome.NOT_IMPLEMENTED if lacks else Outcome.SKIPPED
            yield Result(case=case, outcome=outcome, text=why)
            continue
        yield from _too_much(session, last)
        last = session.ask(case)
        yield last
    yield from _too_much(session, last)


def _too_much(session: Session, last: Result | None) -> Iterator[Result]:
    came = session.unsolicited()
    if came and last and last.outcome is Outcome.PASSED:
        shown = shortened(came.decode("utf-8", errors="replace").rstrip("\r\n"))
        text = f"an extra line after the answer: {shown!r}"
        yield dataclasses.replace(last, outcome=Outcome.RUBBISH, text=text, came=came.rstrip())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plan:
    """A run against a testee that has not begun.

    :param command: the program and its arguments.
    :param protocols: the protocols to test.
    :param named: whether the protocols were selected by name; otherwise they are all installed ones.
    :param timeout: seconds within which an answer must arrive.
    :param expected: the file of expected failures.
    :param only: patterns of ids, groups or messages; empty for all cases.
    :param seed: the seed of all random choices.
    """

    command: tuple[str, ...]
    protocols: tuple[Protocol, ...]
    named: bool = False
    timeout: float = TIMEOUT
    expected: Path | None = None
    only: tuple[str, ...] = ()
    seed: int = 1

    def cases(self) -> list[Case]:
        """Return the selected cases, without starting the testee.

        Raises :class:`NothingToAskError` if there are none, and :class:`ExpectedFileError` for an invalid
        file.
        """
        expected = read_expected(self.expected) if self.expected else None
        every = plan(self.protocols, self.seed)
        if expected:
            expected.reasons(every, other_protocols(self.protocols))
        return _some(every, self.only)

    def run(self, progress: Progress | None = None) -> Report:
        """Start the testee and run the cases. Raises the same errors as :func:`run`."""
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

        :param only: the id of a case; empty for all selected cases.
        """
        words = ["stagewire", "conformance", "codec"]
        if self.named:
            words += [word for one in self.protocols for word in ("--protocol", one.name)]
        words += ["--timeout", f"{self.timeout:g}"] if self.timeout != TIMEOUT else []
        words += ["--expected", str(self.expected)] if self.expected else []
        for pattern in [only] if only else self.only:
            words += ["--only", pattern]
        return as_typed([*words, "--seed", str(self.seed), "--", *self.command])

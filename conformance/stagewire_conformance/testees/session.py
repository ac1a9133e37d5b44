"""A session with a testee: it runs case after case, and restarts the testee if it is out of step."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn, Protocol

from stagewire_conformance.comparison import Outcome, compare
from stagewire_conformance.testees.case import (
    Case,
    EndedError,
    NotATesteeError,
    NotStartedError,
    SilentError,
    Step,
)
from stagewire_conformance.testees.explanation import explain, shortened
from stagewire_conformance.testees.result import REQUEST, Hello, Result, read

START = 10.0
"""Seconds within which a testee must start and answer ``hello``. A longer timeout extends this."""

STARTS = 200
"""The maximum number of starts in one run."""

TIME_OUTS = 20
"""The maximum number of timeouts in one run."""

Json = Mapping[str, Any]

_FIRST = 1000  # smaller numbers are the ids of hostile lines
_LAST_WORDS = 1.0


class Program(Protocol):
    """The interface of a running testee. :class:`.process.Process` implements it."""

    def send(self, data: bytes) -> None:
        """Queue bytes for writing."""

    def receive(self, timeout: float) -> bytes:
        """Return the next line, or raise :class:`EndedError` or :class:`SilentError`."""

    def early(self) -> bytes:
        """Return a line that has already arrived, or nothing."""

    def said(self) -> str:
        """Return the end of its standard error."""

    def end(self, patience: float = 0.0) -> str:
        """End it, and return a phrase such as ``has ended with …``."""


class GivenUpError(Exception):
    """The run of the testee is given up. The text states the reason."""


class _LostError(Exception):
    """The testee is out of step and must be restarted."""

    def __init__(self, outcome: Outcome, text: str, came: bytes = b"") -> None:
        super().__init__(text)
        self.outcome = outcome
        self.came = came


class _Wrong(NamedTuple):
    """A wrong answer to a line.

    :param lost: whether the testee must be restarted.
    """

    outcome: Outcome
    text: str
    came: bytes
    lost: bool


class Session:
    """Runs cases.

    :param start: starts the testee.
    :param timeout: seconds within which an answer must arrive.
    """

    def __init__(self, start: Callable[[], Program], timeout: float) -> None:
        self._start = start
        self._timeout = timeout
        self._line: Program | None = None
        self._number = _FIRST
        self._sent: set[str] = set()
        self._time_outs = 0
        self.starts = 0

    def hello(self) -> Hello:
        """Start the testee, and return its answer to ``hello``.

        Raises :class:`NotStartedError` if it cannot be started, and :class:`NotATesteeError` if it does not
        answer as a testee.
        """
        self.starts += 1
        self._sent.clear()
        line = self._line = self._start()
        line.send(json.dumps(REQUEST).encode("ascii") + b"\n")
        try:
            return read(_object(self._receive(line, max(START, self._timeout))))
        except (_LostError, NotATesteeError, RecursionError) as error:
            said = self._drop()
            more = f"\nits standard error ends with: {said}" if said else ""
            raise NotATesteeError(f"after hello: {error}{more}") from None

    def ask(self, case: Case) -> Result:
        """Run a case. Start the testee first if it is not running.

        Raises :class:`GivenUpError` if it cannot be started, or was started too often.
        """
        line = self._line or self._restarted()
        began = time.monotonic()
        numbered = [(step, self._number + place) for place, step in enumerate(case.steps)]
        self._number += len(numbered)
        if case.at_once:
            self._send(line, *numbered)
        for step, number in numbered:
            if not case.at_once:
                self._send(line, (step, number))
            wrong = self._wrong(line, case, step, number)
            if wrong is not None:
                return Result(
                    case=case,
                    outcome=wrong.outcome,
                    text=wrong.text,
                    line=step.line(number).rstrip(b"\n"),
                    wanted=step.wanted,
                    came=wrong.came.rstrip(b"\r\n"),
                    said=self._drop() if wrong.lost else "",
                    seconds=time.monotonic() - began,
                )
        return Result(case=case, outcome=Outcome.PASSED, seconds=time.monotonic() - began)

    def unsolicited(self) -> bytes:
        """Return a line that arrived without a request. The testee is then restarted."""
        came = self._line.early() if self._line else b""
        if came:
            self._drop()
        return came

    def close(self) -> None:
        """End the testee. If it does not end by itself, terminate it."""
        line, self._line = self._line, None
        if line:
            line.end(_LAST_WORDS)

    def _restarted(self) -> Program:
        if self.starts >= STARTS:
            raise GivenUpError(f"the testee was started {self.starts} times")
        if self._time_outs >= TIME_OUTS:
            raise GivenUpError(f"the testee did not answer {self._time_outs} lines")
        try:
            self.hello()
        except (NotStartedError, NotATesteeError) as error:
            raise GivenUpError(f"the testee could not be restarted: {error}") from None
        assert self._line is not None
        return self._line

    def _drop(self) -> str:
        """End the testee immediately, and return the end of its standard error."""
        line, self._line = self._line, None
        if line is None:
            return ""
        line.end()
        return line.said()

    def _send(self, line: Program, *numbered: tuple[Step, int]) -> None:
        line.send(b"".join(step.line(number) for step, number in numbered))
        for step, number in numbered:
            self._sent.update(json.dumps(id) for id in step.echoes(number) if id is not None)

    def _wrong(self, line: Program, case: Case, step: Step, number: int) -> _Wrong | None:
        """Read an answer, and return what is wrong with it; None if nothing is."""
        came = b""
        try:
            came = self._receive(line, self._timeout)
            answer = _object(came)
            self._in_order(step, number, answer)
            outcome = compare(step.wanted, answer, step.echoes(number))
            if outcome is Outcome.PASSED:
                return None
            # with lines sent at once, the other answers are still to come
            return _Wrong(outcome, explain(case, step, answer, number), came, lost=case.at_once)
        except _LostError as lost:
            return _Wrong(lost.outcome, str(lost), came or lost.came, lost=True)
        except RecursionError:
            return _Wrong(Outcome.RUBBISH, "the answer is nested too deeply", came, lost=True)

    def _receive(self, line: Program, timeout: float) -> bytes:
        """Return the next complete line."""
        try:
            came = line.receive(timeout)
        except SilentError:
            self._time_outs += 1
            raise _LostError(Outcome.TIMED_OUT, f"no answer within {timeout:g} seconds") from None
        except EndedError:
            text = f"the testee {line.end(_LAST_WORDS)} instead of answering"
            raise _LostError(Outcome.CRASHED, text) from None
        if not came.endswith(b"\n"):
            text = f"the testee {line.end(_LAST_WORDS)} in the middle of an answer"
            raise _LostError(Outcome.CRASHED, text, came)
        return came

    def _in_order(self, step: Step, number: int, answer: Json) -> None:
        """Raise :class:`_LostError` for the answer to another line."""
        id = json.dumps(answer.get("id"))
        due = [json.dumps(id) for id in step.echoes(number)]
        if id in self._sent and id not in due:
            text = f"received the answer to {shortened(id)}, expected that to {shortened(due[0])}"
            raise _LostError(Outcome.OUT_OF_ORDER, text)


def _object(came: bytes) -> Json:
    """Return the JSON object on a line."""
    try:
        answer = json.loads(came.decode("utf-8"), parse_constant=_constant)
    except ValueError as error:
        raise _LostError(Outcome.RUBBISH, f"{_shown(came)} is not JSON: {error}") from None
    if not isinstance(answer, dict):
        raise _LostError(Outcome.RUBBISH, f"{_shown(came)} is not a JSON object")
    return answer


def _constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")


def _shown(came: bytes) -> str:
    return repr(shortened(came.decode("utf-8", errors="replace").rstrip("\r\n")))

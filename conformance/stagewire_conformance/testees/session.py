"""A testee that is asked case after case, and started anew where it has lost its way."""

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
"""Seconds that a testee may take to start and to answer ``hello``; more, where the time-out is longer."""

STARTS = 200
"""How often a testee is started in one run."""

TIME_OUTS = 20
"""How often a run waits in vain for an answer."""

Json = Mapping[str, Any]

_FIRST = 1000  # smaller numbers are the ids of hostile lines
_LAST_WORDS = 1.0


class Program(Protocol):
    """What a session needs of a running testee; :class:`.process.Process` is one."""

    def send(self, data: bytes) -> None:
        """Have bytes written."""

    def receive(self, timeout: float) -> bytes:
        """Return the next line, or raise :class:`EndedError` or :class:`SilentError`."""

    def early(self) -> bytes:
        """Return a line that is there without a wait; empty where none is."""

    def said(self) -> str:
        """Return the last of what it has said on standard error."""

    def end(self, patience: float = 0.0) -> str:
        """End it, and return how it ended, as words that follow its name."""


class GivenUpError(Exception):
    """The testee is not asked any further; the text says why."""


class _LostError(Exception):
    """Nobody knows any more what the next line will answer: the testee has to be started anew."""

    def __init__(self, outcome: Outcome, text: str, came: bytes = b"") -> None:
        super().__init__(text)
        self.outcome = outcome
        self.came = came


class _Wrong(NamedTuple):
    """What is wrong with the answer to a line.

    :param lost: whether the testee has to be started anew.
    """

    outcome: Outcome
    text: str
    came: bytes
    lost: bool


class Session:
    """Asks cases.

    :param start: starts the testee.
    :param timeout: seconds that an answer may take.
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
        """Start the testee, and return what it says of itself.

        Raises :class:`NotStartedError` where it cannot be started, :class:`NotATesteeError` where it does
        not answer as a testee does.
        """
        self.starts += 1
        self._sent.clear()
        line = self._line = self._start()
        line.send(json.dumps(REQUEST).encode("ascii") + b"\n")
        try:
            return read(_object(self._receive(line, max(START, self._timeout))))
        except (_LostError, NotATesteeError, RecursionError) as error:
            said = self._drop()
            more = f"\non standard error it said: {said}" if said else ""
            raise NotATesteeError(f"asked hello: {error}{more}") from None

    def ask(self, case: Case) -> Result:
        """Ask a case; a testee that is not running is started first.

        Raises :class:`GivenUpError` where it cannot be, or that was done too often.
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
        """Return a line that has come though nothing was asked; the testee is then started anew."""
        came = self._line.early() if self._line else b""
        if came:
            self._drop()
        return came

    def close(self) -> None:
        """End the testee: it may do so by itself, and is made to where it does not."""
        line, self._line = self._line, None
        if line:
            line.end(_LAST_WORDS)

    def _restarted(self) -> Program:
        if self.starts >= STARTS:
            raise GivenUpError(f"the testee has been started {self.starts} times")
        if self._time_outs >= TIME_OUTS:
            raise GivenUpError(f"the testee has left {self._time_outs} lines without an answer")
        try:
            self.hello()
        except (NotStartedError, NotATesteeError) as error:
            raise GivenUpError(f"the testee could not be started again: {error}") from None
        assert self._line is not None
        return self._line

    def _drop(self) -> str:
        """End the testee at once, and return the last of what it said on standard error."""
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
        """Read an answer, and return what is wrong with it; None where it is the wanted one."""
        came = b""
        try:
            came = self._receive(line, self._timeout)
            answer = _object(came)
            self._in_order(step, number, answer)
            outcome = compare(step.wanted, answer, step.echoes(number))
            if outcome is Outcome.PASSED:
                return None
            # of lines that were sent at once the other answers are still to come
            return _Wrong(outcome, explain(case, step, answer, number), came, lost=case.at_once)
        except _LostError as lost:
            return _Wrong(lost.outcome, str(lost), came or lost.came, lost=True)
        except RecursionError:
            return _Wrong(Outcome.RUBBISH, "the answer is nested too deeply", came, lost=True)

    def _receive(self, line: Program, timeout: float) -> bytes:
        """Return the next line, whole."""
        try:
            came = line.receive(timeout)
        except SilentError:
            self._time_outs += 1
            raise _LostError(Outcome.TIMED_OUT, f"no answer within {timeout:g} seconds") from None
        except EndedError:
            text = f"the testee {line.end(_LAST_WORDS)}, in the place of an answer"
            raise _LostError(Outcome.CRASHED, text) from None
        if not came.endswith(b"\n"):
            text = f"the testee {line.end(_LAST_WORDS)}, in the middle of an answer"
            raise _LostError(Outcome.CRASHED, text, came)
        return came

    def _in_order(self, step: Step, number: int, answer: Json) -> None:
        """Raise :class:`_LostError` for the answer to another line."""
        id = json.dumps(answer.get("id"))
        due = [json.dumps(id) for id in step.echoes(number)]
        if id in self._sent and id not in due:
            text = f"the answer to {shortened(id)} has come, that to {shortened(due[0])} was due"
            raise _LostError(Outcome.OUT_OF_ORDER, text)


def _object(came: bytes) -> Json:
    """Return the JSON object on a line."""
    try:
        answer = json.loads(came.decode("utf-8"), parse_constant=_constant)
    except ValueError as error:
        raise _LostError(Outcome.RUBBISH, f"{_shown(came)} is no JSON: {error}") from None
    if not isinstance(answer, dict):
        raise _LostError(Outcome.RUBBISH, f"{_shown(came)} is no JSON object")
    return answer


def _constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number")


def _shown(came: bytes) -> str:
    return repr(shortened(came.decode("utf-8", errors="replace").rstrip("\r\n")))

"""What a run of a testee found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testees.case import Case
from stagewire_conformance.testees.hello import Hello

__all__ = ["Report", "Result"]

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of one case.

    :param text: what came, and what should have come, in one sentence; of one that was skipped, why.
    :param line: the line after which it went wrong, without its end; empty where all went well.
    :param wanted: the answer that it should have had.
    :param came: the line that came instead; empty for none.
    :param said: the last of what the testee said on standard error before it had to be started anew.
    :param expected: why it is expected to fail; empty where it is not.
    :param seconds: how long it took.
    """

    case: Case
    outcome: Outcome
    text: str = ""
    line: bytes = b""
    wanted: Json | None = None
    came: bytes = b""
    said: str = ""
    expected: str = ""
    seconds: float = 0.0

    @property
    def failed(self) -> bool:
        """Whether it is counted against the testee: a failure nobody expects, or a pass nobody does."""
        if self.outcome is Outcome.SKIPPED:
            return False
        return (self.outcome is Outcome.PASSED) == bool(self.expected)

    @property
    def word(self) -> str:
        """How the result is called."""
        if not self.expected or self.outcome is Outcome.SKIPPED:
            return str(self.outcome)
        return "unexpected pass" if self.failed else f"{self.outcome}, as expected"


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """A run.

    :param command: the program and its arguments.
    :param hello: what the testee says of itself.
    :param results: of the cases that were run or skipped, in order.
    :param not_run: the cases that were not reached.
    :param unfinished: why not; empty when the run came to its end.
    :param interrupted: whether the user has ended it.
    :param starts: how often the testee was started.
    :param seed: what decided whatever chance decides.
    :param timeout: seconds that an answer may take.
    """

    command: tuple[str, ...]
    hello: Hello
    results: tuple[Result, ...]
    not_run: tuple[Case, ...]
    unfinished: str
    interrupted: bool
    starts: int
    seed: int
    timeout: float
    started: datetime
    seconds: float

    def failures(self) -> list[Result]:
        """Return what is counted against the testee."""
        return [result for result in self.results if result.failed]

    def counts(self) -> Counter[str]:
        """Return how many results are called how."""
        return Counter(result.word for result in self.results)

"""The result of a run against a testee: its greeting, and an outcome for each case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testee import TESTEE
from stagewire_conformance.testees.case import Case, NotATesteeError

REQUEST = {"id": 0, "op": "hello"}


@dataclass(frozen=True, slots=True)
class Hello:
    """Who a testee is and what it can do.

    :param implementation: its name.
    :param version: its own version.
    :param protocols: the protocols that it speaks, by name.
    :param operations: of ``decode``, ``encode`` and ``stream`` those that it has; ``hello`` it has.
    """

    implementation: str
    version: str
    protocols: tuple[str, ...]
    operations: tuple[str, ...]


def read(answer: Mapping[str, Any]) -> Hello:
    """Return what an answer to ``hello`` says.

    Raises :class:`NotATesteeError` for an answer that says something else, or speaks of another version of
    the testee protocol than that of this suite.
    """
    if answer.get("ok") is not True:
        raise NotATesteeError(f"it refuses hello: {answer.get('detail') or answer.get('error')}")
    if answer.get("id") != REQUEST["id"]:
        raise NotATesteeError(f"its answer to hello has the id {answer.get('id')!r}, not 0")
    version = answer.get("testee")
    if version != TESTEE or isinstance(version, bool):
        raise NotATesteeError(
            f"it speaks version {version!r} of the testee protocol; this suite speaks {TESTEE}"
        )
    for key in ("implementation", "version"):
        if not isinstance(answer.get(key), str):
            raise NotATesteeError(f"its answer to hello has no {key}, as text")
    for key in ("protocols", "operations"):
        names = answer.get(key)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise NotATesteeError(f"its answer to hello has no {key}, as a list of texts")
    return Hello(
        implementation=answer["implementation"],
        version=answer["version"],
        protocols=tuple(answer["protocols"]),
        operations=tuple(answer["operations"]),
    )


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

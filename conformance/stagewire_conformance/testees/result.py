"""The result of a run against a testee: its answer to ``hello``, and an outcome for each case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testee import TESTEE
from stagewire_conformance.testees.case import Case, NotATesteeError

REQUEST = {"id": 0, "op": "hello"}


@dataclass(frozen=True, slots=True)
class Hello:
    """The name and the abilities of a testee.

    :param implementation: its name.
    :param version: its own version.
    :param protocols: the names of the supported protocols.
    :param operations: the supported ones of ``decode``, ``encode`` and ``stream``.
    :param messages: protocol -> the implemented messages. A testee implements all messages of the other
        protocols.
    """

    implementation: str
    version: str
    protocols: tuple[str, ...]
    operations: tuple[str, ...]
    messages: Mapping[str, frozenset[str]] = field(default_factory=dict, hash=False)

    def lacks(self, protocol: str, needs: Collection[str] | None) -> bool:
        """Return whether it does not implement a message of ``needs``, which is None for all messages."""
        if protocol not in self.messages:
            return False
        return needs is None or not self.messages[protocol].issuperset(needs)


def read(answer: Mapping[str, Any]) -> Hello:
    """Read an answer to ``hello``.

    Raises :class:`NotATesteeError` for an invalid answer, or for another version of the testee protocol than
    that of this suite.
    """
    if answer.get("ok") is not True:
        raise NotATesteeError(
            f"it refused hello: {answer.get('detail') or answer.get('error') or 'no reason given'}"
        )
    if answer.get("id") != REQUEST["id"]:
        raise NotATesteeError(f"its answer to hello has the id {answer.get('id')!r}, expected 0")
    version = answer.get("testee")
    if version != TESTEE or isinstance(version, bool):
        raise NotATesteeError(
            f"it uses version {version!r} of the testee protocol; this suite requires version {TESTEE}"
        )
    for key in ("implementation", "version"):
        if not isinstance(answer.get(key), str):
            raise NotATesteeError(f"{key} is missing in its answer to hello, or not a string")
    for key in ("protocols", "operations"):
        names = answer.get(key)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise NotATesteeError(
                f"{key} is missing in its answer to hello, or not a list of strings"
            )
    return Hello(
        implementation=answer["implementation"],
        version=answer["version"],
        protocols=tuple(answer["protocols"]),
        operations=tuple(answer["operations"]),
        messages=_messages(answer.get("messages", {})),
    )


def _messages(stated: Any) -> Mapping[str, frozenset[str]]:
    """Return the implemented messages by protocol. Their names are compared with the registry later."""
    if not isinstance(stated, dict) or not all(
        isinstance(names, list) and all(isinstance(name, str) for name in names)
        for names in stated.values()
    ):
        raise NotATesteeError(
            "messages in its answer to hello is not an object with a list of message names for each protocol"
        )
    return {protocol: frozenset(names) for protocol, names in stated.items()}


Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """The result of one case.

    :param text: one sentence: what was received and what was expected; for a skipped case, the reason.
    :param line: the line without its end that was answered wrongly; empty if the case passed.
    :param wanted: the expected answer.
    :param came: the line that was received; empty if there was none.
    :param said: the end of its standard error before the testee had to be restarted.
    :param expected: why it is expected to fail; empty if it is not.
    :param seconds: the duration.
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
    def ran(self) -> bool:
        """Whether the case was run."""
        return self.outcome not in (Outcome.SKIPPED, Outcome.NOT_IMPLEMENTED)

    @property
    def failed(self) -> bool:
        """Whether it counts as a failure: an unexpected failure, or an unexpected pass."""
        if not self.ran:
            return False
        return (self.outcome is Outcome.PASSED) == bool(self.expected)

    @property
    def word(self) -> str:
        """The name of the result."""
        if not self.expected or not self.ran:
            return str(self.outcome)
        return "unexpected pass" if self.failed else f"{self.outcome}, as expected"


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """A run.

    :param command: the program and its arguments.
    :param hello: its name and abilities.
    :param results: of the cases that were run or skipped, in order.
    :param not_run: the cases that were not reached.
    :param unselected: the number of cases that were not selected.
    :param unfinished: why the run did not finish; empty if it did.
    :param interrupted: whether the user interrupted it.
    :param starts: how often the testee was started.
    :param seed: the seed of all random choices.
    :param timeout: seconds within which an answer must arrive.
    """

    command: tuple[str, ...]
    hello: Hello
    results: tuple[Result, ...]
    not_run: tuple[Case, ...]
    unselected: int
    unfinished: str
    interrupted: bool
    starts: int
    seed: int
    timeout: float
    started: datetime
    seconds: float

    def failures(self) -> list[Result]:
        """Return the results that count as failures."""
        return [result for result in self.results if result.failed]

    def counts(self) -> Counter[str]:
        """Return the number of results by name."""
        return Counter(result.word for result in self.results)

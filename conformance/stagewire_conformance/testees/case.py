"""A case for a testee: the lines to send, and the expected answers.

The errors state why a testee cannot be tested, or not completely.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stagewire.errors import StagewireError


class NotStartedError(StagewireError):
    """The program does not exist or cannot be run."""


class NotATesteeError(StagewireError):
    """The program runs, but does not answer ``hello`` as a testee."""


class NothingToAskError(StagewireError):
    """No case is selected."""


class ExpectedFileError(StagewireError):
    """An invalid file of expected failures. The message has one line per problem."""


class EndedError(StagewireError):
    """The testee ended instead of answering."""


class SilentError(StagewireError):
    """The testee did not answer in time."""


Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Step:
    """One line and its expected answer.

    :param wanted: the expected answer without ``id`` and ``detail``; empty if any answer of the right shape
        is accepted.
    :param request: the request without an id.
    :param raw: a literal line without its end, instead of a request.
    :param ids: the ids that the answer to ``raw`` may have.
    """

    wanted: Json
    request: Json | None = None
    raw: bytes = b""
    ids: tuple[int | str | None, ...] = ()

    def line(self, number: int) -> bytes:
        """Return the line to send, with its end; ``number`` is the id of a request."""
        if self.request is None:
            return self.raw + b"\n"
        return json.dumps({"id": number, **self.request}).encode("ascii") + b"\n"

    def echoes(self, number: int) -> tuple[int | str | None, ...]:
        """Return the ids that the answer to :meth:`line` may have."""
        return (number,) if self.request is not None else self.ids


@dataclass(frozen=True, slots=True)
class Case:
    """A test case: some lines with their expected answers.

    :param id: unique in a run, and the same in every run.
    :param group: the group of cases that it belongs to.
    :param about: what it tests, if the id does not state it.
    :param protocol: the protocol that a testee has to support; empty for any.
    :param operations: the operations that it needs.
    :param message: the tested message, if any.
    :param needs: the messages that a testee has to implement; None for all.
    :param field: the tested field, if any.
    :param at_once: whether all lines are sent before the first answer is read.
    """

    id: str
    group: str
    steps: tuple[Step, ...]
    about: str = ""
    protocol: str = ""
    operations: frozenset[str] = frozenset()
    message: str = ""
    needs: frozenset[str] | None = frozenset()
    field: str = ""
    at_once: bool = False


def ask(request: Json, wanted: Json) -> Step:
    """Return a step that sends a request, which may be any JSON object."""
    return Step(wanted=wanted, request=request)


def send(raw: bytes, wanted: Json, *ids: int | str | None) -> Step:
    """Return a step that sends a literal line and accepts an answer with one of ``ids``."""
    return Step(wanted=wanted, raw=raw, ids=ids)

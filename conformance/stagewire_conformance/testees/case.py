"""A case for a testee: the lines that it is sent, and the answers that it has to give.

Errors say why a testee cannot be tested, or not to the end.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stagewire.errors import StagewireError


class NotStartedError(StagewireError):
    """There is no such program, or it cannot be run."""


class NotATesteeError(StagewireError):
    """The program runs, and does not answer ``hello`` as a testee does."""


class NothingToAskError(StagewireError):
    """No case is left to be asked."""


class ExpectedFileError(StagewireError):
    """The file of expected failures cannot be used: a line for each mistake."""


class EndedError(StagewireError):
    """The testee has ended where an answer was due."""


class SilentError(StagewireError):
    """The testee has not answered in time."""


Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Step:
    """One line, and the answer to it.

    :param wanted: the answer without ``id`` and ``detail``; empty where any answer of the right shape
        will do.
    :param request: what is asked; whoever sends it chooses the id.
    :param raw: in the place of a request: a line as it stands, without its end.
    :param ids: the ids that the answer to ``raw`` may have.
    """

    wanted: Json
    request: Json | None = None
    raw: bytes = b""
    ids: tuple[int | str | None, ...] = ()

    def line(self, number: int) -> bytes:
        """Return the line to be sent, with its end; ``number`` is the id of a request."""
        if self.request is None:
            return self.raw + b"\n"
        return json.dumps({"id": number, **self.request}).encode("ascii") + b"\n"

    def echoes(self, number: int) -> tuple[int | str | None, ...]:
        """Return the ids that the answer to :meth:`line` may have."""
        return (number,) if self.request is not None else self.ids


@dataclass(frozen=True, slots=True)
class Case:
    """Some lines that look at one thing.

    :param id: unique in a run, and the same in every run.
    :param group: cases that belong together.
    :param about: what it looks at, where the id does not say it.
    :param protocol: the protocol that a testee has to speak for it; empty for any.
    :param operations: the operations that it needs.
    :param message: the message that it is about, if it is about one.
    :param field: likewise the field.
    :param at_once: whether all lines are sent before the first answer is read.
    """

    id: str
    group: str
    steps: tuple[Step, ...]
    about: str = ""
    protocol: str = ""
    operations: frozenset[str] = frozenset()
    message: str = ""
    field: str = ""
    at_once: bool = False


def ask(request: Json, wanted: Json) -> Step:
    """Return the step that sends a request; it may be any JSON object."""
    return Step(wanted=wanted, request=request)


def send(raw: bytes, wanted: Json, *ids: int | str | None) -> Step:
    """Return the step that sends a line as it stands, and takes an answer with one of ``ids``."""
    return Step(wanted=wanted, raw=raw, ids=ids)

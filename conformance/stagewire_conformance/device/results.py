"""Results of a check: verdicts, findings, and the bytes that passed on the link."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property


class Result(StrEnum):
    """What came out of a check, or of one thing that it looked at.

    ``FAIL``: what the document states as a fact or a duty does not hold. ``NON_STRICT``: what it advises or
    calls usual does not, or the controller does what others are known to do beside it. ``INFO``: nothing
    could be decided, such as a time on a computer that is late itself. ``SKIP``: the controller does not
    claim it, as its PICS says.
    """

    PASS = "PASS"
    NON_STRICT = "NON-STRICT"
    FAIL = "FAIL"
    INFO = "INFO"
    SKIP = "SKIP"


_GRAVITY = (Result.PASS, Result.SKIP, Result.INFO, Result.NON_STRICT, Result.FAIL)


def worst(results: Iterable[Result]) -> Result:
    """Return the gravest of some results; ``PASS`` of none."""
    return max(results, key=_GRAVITY.index, default=Result.PASS)


@dataclass(frozen=True)
class Finding:
    """One thing that a check found.

    :param text: a sentence: what came, and what should have come.
    :param wanted: the bytes that should have come, if that is known.
    :param came: the bytes that it is about, if there are any.
    """

    result: Result
    text: str
    wanted: bytes | None = None
    came: bytes | None = None


@dataclass(frozen=True)
class Entry:
    """Something that passed on the line.

    :param time: in seconds since the line was opened.
    :param sent: whether the suite sent it.
    :param raw: its bytes.
    :param keep_alive: whether it was sent by itself, to keep the controller talking.
    :param tell: says what it is, when somebody wants to know: most entries nobody reads.
    """

    time: float
    sent: bool
    raw: bytes
    keep_alive: bool = False
    tell: Callable[[], str] = field(default=str, repr=False, compare=False)

    @cached_property
    def text(self) -> str:
        """What it says, in one line."""
        return self.tell()

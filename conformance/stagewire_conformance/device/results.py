"""Results of a check: verdicts, findings, and the bytes that passed on the link."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property


class Result(StrEnum):
    """The result of a check, or of one finding.

    ``FAIL``: the controller violates a requirement of the document. ``NON_STRICT``: it departs from a
    recommendation or from usual behaviour, or behaves in a way that is known from other controllers.
    ``FRAGILE``: it does not cope with damaged input, which the document does not demand.
    ``INFO``: the check could not decide, for example about a time on a computer that is late itself.
    ``SKIP``: the PICS states that the controller does not support this. ``NOT_RUN``: the check met a defect
    that another check has reported, so it could not decide.
    """

    PASS = "PASS"
    NON_STRICT = "NON-STRICT"
    FAIL = "FAIL"
    FRAGILE = "FRAGILE"
    INFO = "INFO"
    SKIP = "SKIP"
    NOT_RUN = "NOT RUN"


_GRAVITY = (
    Result.PASS,
    Result.SKIP,
    Result.INFO,
    Result.NOT_RUN,
    Result.FRAGILE,
    Result.NON_STRICT,
    Result.FAIL,
)


def worst(results: Iterable[Result]) -> Result:
    """Return the worst of some results, or ``PASS`` if there are none."""
    return max(results, key=_GRAVITY.index, default=Result.PASS)


@dataclass(frozen=True)
class Finding:
    """One observation of a check.

    :param text: a sentence that states what was received and what was expected.
    :param wanted: the expected bytes, if known.
    :param came: the received bytes, if any.
    :param rule: the slug of the rule that the controller breaks; empty if it breaks none.
    """

    result: Result
    text: str
    wanted: bytes | None = None
    came: bytes | None = None
    rule: str = ""


@dataclass(frozen=True)
class Entry:
    """Bytes that passed on the line.

    :param time: seconds since the line was opened.
    :param sent: whether the suite sent them.
    :param raw: the bytes.
    :param keep_alive: whether this is a keep-alive message that the line sent automatically.
    :param tell: returns a description. It is called only when needed, because few entries are read.
    """

    time: float
    sent: bool
    raw: bytes
    keep_alive: bool = False
    tell: Callable[[], str] = field(default=str, repr=False, compare=False)

    @cached_property
    def text(self) -> str:
        """The description, in one line."""
        return self.tell()

"""What can come out of a check."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

__all__ = ["Result", "worst"]


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

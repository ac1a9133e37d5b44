"""Root causes: defects that one check reports, and that later checks meet again.

One message with a wrong length can spoil many checks. The first check that meets it reports a finding with a
:class:`Cause`. A later check that meets the same cause adds no finding: it refers to the first check.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from stagewire_conformance.device.results import Result

DELIVERY: Final = "delivery"
"""The message does not arrive, or its bytes are not a message: its length or addresses are wrong."""
EXTRA: Final = "extra"
"""Its packet is longer than documented."""
CHANNEL: Final = "channel"
"""It names another channel."""
UNSOLICITED: Final = "unsolicited"
"""It was sent without a request."""
ENDED: Final = "end"
"""The message comes periodically, but ends before it is stopped."""
SHARED: Final = "another bay or channel"
"""A SET also sets another bay or channel, or a command also acts there."""
EFFECT: Final = "effect"
"""The command does not have its effect."""
MOTION_AT_REST: Final = "motion bits at rest"
"""The message reports motion although nothing moves."""

_ALIKE: Final = 8
"""Counts by which two missed targets may differ and still be alike."""
_ABOUT: Final = 1.1
"""The ratio of two missed parts of the way up to which they are alike."""


@dataclass(frozen=True)
class Miss:
    """A target that was missed.

    :param missed: the counts from the target to the final position.
    :param way: the commanded distance.
    """

    missed: int
    way: int

    def is_like(self, other: Miss) -> bool:
        """Return whether two targets were missed alike, so that the defect is the same.

        They were if the counts are the same, the counts before or after the target, or the part of the way.
        Motors that did not move, or in the wrong direction, have nothing in common.
        """
        if any(10 * abs(each.missed) >= 9 * abs(each.way) for each in (self, other)):
            return False
        along, its = ((each.missed if each.way > 0 else -each.missed) for each in (self, other))
        apart = min(abs(self.missed - other.missed), abs(along - its))
        parts = along / abs(self.way), its / abs(other.way)
        similar = parts[0] * parts[1] > 0 and max(map(abs, parts)) <= _ABOUT * min(map(abs, parts))
        return similar or apart <= max(_ALIKE, abs(self.missed) // 20)


@dataclass(frozen=True)
class Cause:
    """A defect that several checks can meet.

    :param subject: what has the defect: the name of a message, or a target.
    :param aspect: what is wrong with it, such as :data:`DELIVERY`, or the name of a field.
    :param miss: how far from its target a command has moved something; None for other defects.
    """

    subject: str
    aspect: str
    miss: Miss | None = field(default=None, compare=False)

    def __str__(self) -> str:
        return f"{self.subject} ({self.aspect})"


NOW_AND_THEN: Final = Cause("replies", "now and then")
"""The defect that a reply is lost or damaged now and then: when the request is repeated, it is answered."""


def silence(place: str) -> Cause:
    """Return the cause for a target that answers no request."""
    return Cause(place, "silence")


ADDRESSES: Final = "addresses"
"""The subject of the causes for messages with wrong addresses: all targets address their messages alike."""


class Causes:
    """The causes that a run has reported so far, each with the check that reported it first."""

    def __init__(self) -> None:
        self._checks: dict[Cause, str] = {}
        self._results: dict[Cause, Result] = {}

    def __iter__(self) -> Iterator[Cause]:
        return iter(self._checks)

    def check_of(self, cause: Cause) -> str:
        """Return the id of the check that reported a cause first; empty if none has."""
        return self._checks.get(cause, "")

    def is_departure(self, cause: Cause) -> bool:
        """Return whether a cause has been reported as NON-STRICT only, so that other checks can continue."""
        return self._results.get(cause) is Result.NON_STRICT

    def is_known(self, cause: Cause, result: Result) -> bool:
        """Return whether a cause has been reported with this result. A FAIL is worse than a NON-STRICT."""
        return cause in self._checks and not (
            self.is_departure(cause) and result is not Result.NON_STRICT
        )

    def report(self, cause: Cause, check: str, result: Result = Result.FAIL) -> None:
        """Record that a check has reported a cause."""
        if not self.is_known(cause, result):
            self._checks[cause] = check
            self._results[cause] = result

"""Root causes: defects that one check reports, and that later checks meet again.

One message with a wrong length can spoil many checks. The first check that meets it reports a finding with a
:class:`Cause`. A later check that meets the same cause adds no finding: it refers to the first check.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

DELIVERY: Final = "delivery"
"""The message does not arrive, or its bytes are not a message: its length or addresses are wrong."""
EXTRA: Final = "extra"
"""Its packet is longer than documented."""
CHANNEL: Final = "channel"
"""It names another channel."""
UNSOLICITED: Final = "unsolicited"
"""It was sent without a request."""
EFFECT: Final = "effect"
"""The command does not have its effect."""


@dataclass(frozen=True)
class Cause:
    """A defect that several checks can meet.

    :param subject: what has the defect: the name of a message, or a target.
    :param aspect: what is wrong with it, such as :data:`DELIVERY`, or the name of a field.
    """

    subject: str
    aspect: str

    def __str__(self) -> str:
        return f"{self.subject} ({self.aspect})"


def silence(place: str) -> Cause:
    """Return the cause for a target that answers no request."""
    return Cause(place, "silence")


def addresses(place: str, dest: int | None, source: int | None) -> Cause:
    """Return the cause for messages of a target with wrong addresses."""
    return Cause(place, f"addresses {_hex(source)} to {_hex(dest)}")


def _hex(address: int | None) -> str:
    return "unknown" if address is None else f"{address:#04x}"


class Causes:
    """The causes that a run has reported so far, each with the check that reported it first."""

    def __init__(self) -> None:
        self._reported: dict[Cause, str] = {}

    def check_of(self, cause: Cause) -> str:
        """Return the id of the check that reported a cause first; empty if none has."""
        return self._reported.get(cause, "")

    def report(self, cause: Cause, check: str) -> None:
        """Record that a check has reported a cause."""
        self._reported.setdefault(cause, check)

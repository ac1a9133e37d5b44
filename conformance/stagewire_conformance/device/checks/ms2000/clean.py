"""The clean request that follows whatever is wrong: a controller has to answer it as if nothing had been."""

from __future__ import annotations

from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import messages as m

_REQUESTS: Final[tuple[Command, ...]] = (
    m.ReadMaximumSpeed(), m.ReadRampTime(), m.ReadIncrementValue(), m.ReadIdentification(), m.ReadStatus(),
)  # fmt: skip
"""What a clean request may be, the first that a controller claims: it answers the same at any time."""


class Clean:
    """A request and the answer that it has to have, asked for at the beginning of a check."""

    def __init__(self, trial: Trial) -> None:
        self._axis = Axis(trial, asked(trial.declared)[0])
        self._request = asked(trial.declared)[1]
        self._answer = self._axis.ask(self._request)

    def again(self, after: str) -> None:
        """Ask again; see that the answer is exactly the same.

        :param after: what went before, for the text of the finding.
        """
        reply = self._axis.ask(self._request, after=after)
        self._axis.trial.must(
            reply == self._answer,
            f"{after}, {self._request.layout.message} was answered by other bytes than before",
            wanted=self._answer.pack(),
            came=reply.pack(),
        )


def asked(declared: Declaration) -> tuple[Target, Command]:
    """Return the axis and the request of clean requests; their first if nothing of them is claimed."""
    for request in _REQUESTS:
        for place in declared.places:
            if request.layout.message in place.messages:
                return place, request
    return declared.places[0], _REQUESTS[0]

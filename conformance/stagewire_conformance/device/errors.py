"""Errors that end or prevent a run. Defects of a controller are findings, not errors."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire.errors import StagewireError


class NotAllowedError(StagewireError):
    """A check tried to send a message that is not allowed. Nothing was sent; the check has a defect."""


class NothingAnswersError(StagewireError):
    """The controller does not answer, or its answer is not of the protocol."""


class NothingToRunError(StagewireError):
    """The selection contains no check that can run."""


class DeclarationError(StagewireError):
    """A controller without a declaration, or a unit that contradicts its PICS."""


class PicsError(StagewireError):
    """An invalid PICS.

    :param problems: one sentence for each problem, with file and key.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)

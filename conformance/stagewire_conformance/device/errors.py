"""What goes wrong with a run, as against what is wrong with a controller."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire.errors import StagewireError


class NotAllowedError(StagewireError):
    """A check wanted to send what nobody allowed; nothing was sent. The check has a defect."""


class NothingAnswersError(StagewireError):
    """Nothing answers on the line, or nothing that is of the protocol."""


class NothingToRunError(StagewireError):
    """No check of the suite is chosen by what was asked for."""


class DeclarationError(StagewireError):
    """Nothing declares the controller of a run, or its unit and its PICS contradict each other."""


class PicsError(StagewireError):
    """A PICS that cannot be used.

    :param problems: everything that is wrong with it, one sentence each, with file and key.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)

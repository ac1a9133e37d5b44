"""Why a testee cannot be tested, or not to the end."""

from __future__ import annotations

from stagewire.errors import StagewireError

__all__ = [
    "EndedError",
    "ExpectedFileError",
    "NotATesteeError",
    "NotStartedError",
    "NothingToAskError",
    "SilentError",
]


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

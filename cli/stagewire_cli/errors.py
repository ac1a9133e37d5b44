"""Exit codes, and the error for wrong arguments."""

from __future__ import annotations

OK = 0
WRONG = 1
"""Exit code: the checked input is wrong."""
CALLED_WRONGLY = 2
INTERRUPTED = 130
"""By Ctrl-C or SIGTERM; what shells say of a program that Ctrl-C ended."""


class CalledWronglyError(Exception):
    """The command was called wrongly; the text is a plain sentence for the user."""

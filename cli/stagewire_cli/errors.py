"""Exit codes, and the error for wrong arguments."""

from __future__ import annotations

OK = 0
WRONG = 1
"""Exit code: the checked input is wrong."""
CALLED_WRONGLY = 2
"""Exit code: the arguments are wrong."""
INTERRUPTED = 130
"""Exit code after Ctrl-C or SIGTERM; the one that shells report after Ctrl-C."""


class CalledWronglyError(Exception):
    """The command was called wrongly; the text is a plain sentence for the user."""

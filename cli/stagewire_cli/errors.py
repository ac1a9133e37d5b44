"""What ends a command: exit codes, and being called wrongly."""

from __future__ import annotations

__all__ = ["CALLED_WRONGLY", "OK", "WRONG", "CalledWronglyError"]

OK = 0
WRONG = 1
"""What the command checked is wrong."""
CALLED_WRONGLY = 2


class CalledWronglyError(Exception):
    """The command was called wrongly; the text is a plain sentence for the user."""

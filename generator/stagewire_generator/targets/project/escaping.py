"""Texts of a spec inside TOML and Markdown, so that none can become anything but a text."""

from __future__ import annotations

import re

__all__ = ["markdown", "toml"]

_MARKUP = re.compile(r"([\\`*_\[\]<>&~$])")  # wherever it stands
_AT_THE_START = re.compile(r"^(?:[-+#=|:]|[0-9]+(?=[.)]))")  # of a list, a heading, a table


def toml(text: str) -> str:
    """Return a basic string of TOML, with its quotes; whatever cannot be seen is an escape."""
    escaped = []
    for char in text:
        if char in ('"', "\\"):
            escaped.append("\\" + char)
        elif char.isprintable():
            escaped.append(char)
        else:
            escaped.append(f"\\U{ord(char):08X}")
    return f'"{"".join(escaped)}"'


def markdown(text: str) -> str:
    """Return a line of Markdown that shows the text as it is."""
    escaped = _MARKUP.sub(r"\\\1", text)
    mark = _AT_THE_START.match(escaped)
    if mark is None:
        return escaped
    number = mark[0] if mark[0].isdigit() else ""
    return f"{number}\\{escaped.removeprefix(number)}"

"""Pieces of Python source in their final formatting: literals, calls, docstrings.

Whatever comes from the spec passes through here, so that a text can never become code.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

__all__ = [
    "WIDTH",
    "call",
    "docstring",
    "imported",
    "integer",
    "list_of",
    "literal",
    "long_text",
    "paragraph",
    "tuple_of",
]

WIDTH = 100


def literal(text: str) -> str:
    """Return a string literal, in the quotes that a formatter would choose."""
    quote = "'" if '"' in text and "'" not in text else '"'
    escaped = []
    for char in text:
        if char in ("\\", quote):
            escaped.append("\\" + char)
        elif char.isprintable():
            escaped.append(char)
        else:
            escaped.append(ascii(char)[1:-1])
    return quote + "".join(escaped) + quote


def integer(value: int) -> str:
    """Return an integer as a reader wants it: masks and limits of a width in hex."""
    if value in (0xFF, 0xFFFF, 0xFFFFFFFF, 0x7FFFFFFF, 0x7FFF, -0x8000, -0x80000000):
        return f"-{-value:#X}".replace("X", "x") if value < 0 else f"0x{value:X}"
    return str(value)


def tuple_of(items: Sequence[str]) -> str:
    """Return a tuple display on one line."""
    return f"({', '.join(items)}{',' if len(items) == 1 else ''})"


def call(head: str, arguments: Sequence[str], tail: str, indent: int, width: int = WIDTH) -> str:
    """Return ``head(arguments)tail``: on one line if it fits, else one argument a line.

    The first line carries no indentation (the template has it); the others carry theirs.
    """
    line = f"{head}({', '.join(arguments)}){tail}"
    if indent + len(line) <= width or not arguments:
        return line
    pad = " " * indent
    body = "".join(f"{pad}    {argument},\n" for argument in arguments)
    return f"{head}(\n{body}{pad}){tail}"


def paragraph(text: str, indent: int, hanging: int = 0) -> str:
    """Wrap a text for a docstring; the first line carries no indentation."""
    pad = " " * indent
    lines = textwrap.wrap(
        " ".join(text.split()),
        WIDTH - indent,
        subsequent_indent=" " * hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return f"\n{pad}".join(lines)


def docstring(text: str) -> str:
    """Escape a text for the inside of a triple-quoted docstring."""
    escaped = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    if escaped.endswith('"'):
        escaped = escaped[:-1] + '\\"'
    return escaped


def long_text(head: str, text: str, indent: int) -> str:
    """Return ``head`` and a text literal, in pieces inside brackets if it is long."""
    if indent + len(head) + len(literal(text)) + 1 <= WIDTH:
        return head + literal(text)
    pad = " " * indent
    pieces = textwrap.wrap(text, WIDTH - indent - 8, drop_whitespace=False)
    return f"{head}(\n" + "".join(f"{pad}    {literal(piece)}\n" for piece in pieces) + f"{pad})"


def list_of(items: Sequence[str]) -> str:
    """Return a list display for the left margin: on one line if it fits, else one item a line."""
    line = f"[{', '.join(items)}]"
    if len(line) + len("__all__ = ") <= WIDTH:
        return line
    return "[\n" + "".join(f"    {item},\n" for item in items) + "]"


def imported(module: str, names: Sequence[str]) -> str:
    """Return an import statement, in brackets if it is long."""
    line = f"from {module} import {', '.join(names)}"
    if len(line) <= WIDTH:
        return line
    return f"from {module} import (\n" + "".join(f"    {name},\n" for name in names) + ")"

"""Pieces of Python source in their final formatting: literals, calls, docstrings.

Whatever comes from the spec passes through here, so that a text can never become code.
"""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Sequence
from typing import Final

from stagewire_generator.targets.wrapping import wrapped

__all__ = [
    "SUPPORT",
    "WIDTH",
    "assigned",
    "bracketed",
    "call",
    "docstring",
    "exported",
    "imported",
    "integer",
    "list_of",
    "literal",
    "long_text",
    "natural",
    "paragraph",
    "tuple_of",
    "width",
]

WIDTH = 100


def literal(text: str) -> str:
    """Return a string literal, in the quotes that a formatter would choose."""
    quote = "'" if text.count('"') > text.count("'") else '"'
    if quote not in text and "\\" not in text and text.isprintable():
        return f"{quote}{text}{quote}"  # nearly all of them
    escaped = []
    for char in text:
        if char in ("\\", quote):
            escaped.append("\\" + char)
        elif char.isprintable():
            escaped.append(char)
        else:
            escaped.append(ascii(char)[1:-1])
    return quote + "".join(escaped) + quote


def width(source: str) -> int:
    """Return the columns that a formatter counts for a line: two for a wide sign, none for an accent."""
    if source.isascii():
        return len(source)
    return sum(
        0 if unicodedata.combining(c) else 1 + (unicodedata.east_asian_width(c) in "WF")
        for c in source
    )


def integer(value: int) -> str:
    """Return an integer as a reader wants it: masks and limits of a width in hex."""
    if value in (0xFF, 0xFFFF, 0xFFFFFFFF, 0x7FFFFFFF, 0x7FFF, -0x8000, -0x80000000):
        return f"-{-value:#X}".replace("X", "x") if value < 0 else f"0x{value:X}"
    return str(value)


def tuple_of(items: Sequence[str]) -> str:
    """Return a tuple display on one line."""
    return f"({', '.join(items)}{',' if len(items) == 1 else ''})"


def call(head: str, arguments: Sequence[str], tail: str, indent: int, limit: int = WIDTH) -> str:
    """Return ``head(arguments)tail``: on one line if it fits, else one argument a line.

    The first line carries no indentation (the template has it); the others carry theirs.
    """
    return bracketed(f"{head}(", arguments, f"){tail}", indent, limit)


def bracketed(
    opening: str, items: Sequence[str], closing: str, indent: int, limit: int = WIDTH
) -> str:
    """Return the items between brackets: on one line if it fits, else one item a line."""
    line = f"{opening}{', '.join(items)}{closing}"
    if indent + width(line) <= limit or not items:
        return line
    pad = " " * indent
    body = "".join(f"{pad}    {item},\n" for item in items)
    return f"{opening}\n{body}{pad}{closing}"


def assigned(target: str, value: str, indent: int) -> str:
    """Return the assignment of a value that no bracket breaks: in brackets if it is long."""
    line = f"{target} = {value}"
    if indent + width(line) <= WIDTH:
        return line
    pad = " " * indent
    return f"{target} = (\n{pad}    {value}\n{pad})"


def paragraph(text: str, indent: int, hanging: int = 0) -> str:
    """Wrap a text for a docstring; the first line carries no indentation."""
    pad = " " * indent
    return f"\n{pad}".join(wrapped(text, WIDTH - indent, hanging))


def docstring(text: str) -> str:
    """Escape a text for the inside of a triple-quoted docstring."""
    escaped = text.replace("\\", "\\\\")
    if '"' not in escaped:
        return escaped
    return re.sub(r'\A"+|"{3,}|"+\Z', lambda quotes: '\\"' * len(quotes[0]), escaped)


def long_text(head: str, text: str, indent: int) -> str:
    """Return ``head`` and a text literal, in pieces inside brackets if it is long."""
    if indent + width(head + literal(text)) + 1 <= WIDTH:
        return head + literal(text)
    pad = " " * indent
    pieces = [text]
    if indent + 4 + width(literal(text)) > WIDTH:
        pieces = textwrap.wrap(text, WIDTH - indent - 8, drop_whitespace=False)
    return f"{head}(\n" + "".join(f"{pad}    {literal(piece)}\n" for piece in pieces) + f"{pad})"


def list_of(items: Sequence[str]) -> str:
    """Return a list display for the left margin: on one line if it fits, else one item a line."""
    line = f"[{', '.join(items)}]"
    if len(line) + len("__all__ = ") <= WIDTH:
        return line
    return "[\n" + "".join(f"    {item},\n" for item in items) + "]"


def exported(names: Sequence[str]) -> str:
    """Return the value of ``__all__``, sorted as the linter wants it: constants, classes, functions."""
    return list_of([literal(name) for name in sorted(names, key=_rank)])


def _rank(name: str) -> tuple[int, list[str | int], str]:
    kind = 0 if name.isupper() else 1 if name[:1].isupper() else 2
    return kind, natural(name), name


def natural(name: str) -> list[str | int]:
    """Return a key that sorts ``Bay2`` before ``Bay10``."""
    return [int(part) if part.isdigit() else part for part in re.split(r"([0-9]+)", name)]


SUPPORT: Final = "stagewire.support"
"""The one module of the runtime that a package imports."""


def imported(module: str, names: Sequence[str], indent: int = 0) -> str:
    """Return an import statement, in brackets if it is long; the names as a linter sorts them."""

    def rank(name: str) -> tuple[int, list[str | int], str]:
        kind = 0 if name.isupper() and len(name) > 1 else 1 if name[:1].isupper() else 2
        return kind, natural(name.lower()), name

    names = sorted(names, key=rank)
    renamed = [
        name for name in names if " as " in name
    ]  # a linter gives each a statement of its own
    if renamed and len(names) > 1:
        plain = [name for name in names if name not in renamed]
        groups = sorted(
            [[name] for name in renamed] + ([plain] if plain else []), key=lambda g: rank(g[0])
        )
        return "\n".join(imported(module, group, indent) for group in groups)
    line = f"from {module} import {', '.join(names)}"
    if indent + len(line) <= WIDTH:
        return line
    pad = " " * indent
    body = "".join(f"{pad}    {name},\n" for name in names)
    return f"from {module} import (\n{body}{pad})"

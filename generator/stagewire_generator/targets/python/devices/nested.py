"""Nested displays and calls in their final formatting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from stagewire_generator.targets.python.source import WIDTH, width

__all__ = ["Nested", "Source", "laid_out"]


@dataclass(frozen=True, slots=True)
class Nested:
    """Something in brackets: ``opening``, then items, then ``closing``."""

    opening: str
    items: tuple[Source, ...]
    closing: str


Source: TypeAlias = "str | Nested"


def laid_out(source: Source, indent: int, tail: str = "") -> str:
    """Return the source on one line if it fits, else one item a line, as a formatter has it.

    The first line carries no indentation; the others carry theirs.

    :param tail: what follows on the same line.
    """
    line = _flat(source)
    fits = indent + width(line + tail) <= WIDTH and "\n" not in line
    if isinstance(source, str) or not source.items or fits:
        return line + tail
    pad = " " * (indent + 4)
    body = "".join(f"{pad}{laid_out(item, indent + 4, ',')}\n" for item in source.items)
    return f"{source.opening}\n{body}{' ' * indent}{source.closing}{tail}"


def _flat(source: Source) -> str:
    if isinstance(source, str):
        return source
    inside = ", ".join(_flat(item) for item in source.items)
    alone = len(source.items) == 1 and _is_tuple(source)
    return f"{source.opening}{inside}{',' if alone else ''}{source.closing}"


def _is_tuple(source: Nested) -> bool:
    """Whether the brackets are those of a tuple, and not of a call."""
    before = source.opening[:-1]
    return source.opening.endswith("(") and (not before or before.endswith(("=", " ", ":")))

"""Python source as trees of brackets, broken into lines as a formatter would.

Views hold data and trees. Templates lay them out with the :data:`FUNCTIONS` of this module and pass the
current indentation. The first line is returned without indentation, because the template already has it.
All other lines are indented.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final, NamedTuple, TypeAlias

from stagewire_generator.targets.python.source import WIDTH, literal, width


class Nested(NamedTuple):
    """Something in brackets: ``opening``, then items, then ``closing``.

    :param broken: whether each item has its own line, even if all items fit on one.
    """

    opening: str
    items: tuple[Source, ...]
    closing: str
    broken: bool = False


class Text(NamedTuple):
    """A string literal after ``head``. A long literal is broken into pieces in brackets."""

    head: str
    text: str


class Preferred(NamedTuple):
    """An expression for one line, and an equivalent one for the case that the first does not fit.

    For chains of calls, where a formatter would break the arguments of the first call.
    """

    line: str
    otherwise: Nested


Source: TypeAlias = "str | Text | Preferred | Nested"


class Import(NamedTuple):
    """Names that a module imports from another; ``name as other`` renames one."""

    module: str
    names: tuple[str, ...]


def call(head: str, items: Iterable[Source], tail: str = "", *, broken: bool = False) -> Nested:
    """Return ``head(items)tail``."""
    return Nested(f"{head}(", tuple(items), f"){tail}", broken)


def strings(head: str, texts: Iterable[str]) -> Nested:
    """Return ``head`` and a tuple of string literals."""
    return Nested(f"{head}(", tuple(map(literal, texts)), ")")


def slots(names: Iterable[str]) -> Nested:
    """Return the assignment of ``__slots__``, sorted as a linter does."""
    return strings("__slots__ = ", sorted(names, key=natural))


def mapping(head: str, items: Iterable[Source], *, broken: bool = False) -> Nested:
    """Return ``head`` and a dictionary, or a set, with these items."""
    return Nested(f"{head}{{", tuple(items), "}", broken)


def keyed(key: str, value: Source) -> Source:
    """Return an item of a dictionary."""
    return _after(f"{key}: ", value)


def _after(head: str, source: Source) -> Source:
    if isinstance(source, str):
        return head + source
    if isinstance(source, Text):
        return Text(head + source.head, source.text)
    if isinstance(source, Preferred):
        otherwise = source.otherwise
        return Preferred(head + source.line, otherwise._replace(opening=head + otherwise.opening))
    return Nested(head + source.opening, source.items, source.closing, source.broken)


def listed(head: str, names: Sequence[str]) -> Nested:
    """Return ``head`` and a tuple of names, one per line if there are several."""
    return Nested(f"{head}(", tuple(names), ")", broken=len(names) > 1)


def flat(source: Source) -> str:
    """Return the source on one line."""
    if isinstance(source, str):
        return source
    if isinstance(source, Text):
        return source.head + literal(source.text)
    if isinstance(source, Preferred):
        return source.line
    return _joined(source, map(flat, source.items))


def _joined(source: Nested, items: Iterable[str]) -> str:
    """Return the brackets of ``source`` around ``items`` on one line."""
    alone = len(source.items) == 1 and _is_tuple(source)
    return f"{source.opening}{', '.join(items)}{',' if alone else ''}{source.closing}"


def _fitted(source: Source, room: int) -> str | None:
    """Return the source on one line, or None if a part is broken or the line is wider than ``room``."""
    if isinstance(source, Nested):
        if source.broken:
            return None
        items: list[str] = []
        left = room
        for item in source.items:
            made = _fitted(item, left)
            if made is None:
                return None
            items.append(made)
            left -= width(made)
        line = _joined(source, items)
    else:
        line = flat(source)
    return line if width(line) <= room else None


def laid_out(source: Source, indent: int, tail: str = "", head: str = "") -> str:
    """Return the source on one line if it fits, else with one item per line, as a formatter does.

    :param tail: text after it on the same line.
    :param head: text before it on the same line.
    """
    if head:
        source = _after(head, source)
    if isinstance(source, str):
        return _at_operators(source, indent, tail) + tail
    line = _fitted(source, WIDTH - indent - width(tail))
    if line is not None:
        return line + tail
    if isinstance(source, Text):
        return _in_pieces(source, indent) + tail
    if isinstance(source, Preferred):
        return laid_out(source.otherwise, indent, tail)
    if not source.items:
        return flat(source) + tail
    pad = " " * (indent + 4)
    body = "".join(f"{pad}{laid_out(item, indent + 4, ',')}\n" for item in source.items)
    return f"{source.opening}\n{body}{' ' * indent}{source.closing}{tail}"


def _at_operators(source: str, indent: int, tail: str) -> str:
    """Return an item, with a line for each alternative of its type if one line is too long."""
    if indent + width(source) + width(tail) <= WIDTH:
        return source
    return source.replace(" | ", f"\n{' ' * indent}| ")


def _is_tuple(source: Nested) -> bool:
    """Whether the brackets belong to a tuple, not to a call."""
    before = source.opening[:-1]
    return source.opening.endswith("(") and (not before or before.endswith(("=", " ", ":")))


def _in_pieces(source: Text, indent: int) -> str:
    pad = " " * indent
    pieces = [source.text]
    if indent + 4 + width(literal(source.text)) > WIDTH:
        pieces = textwrap.wrap(source.text, WIDTH - indent - 8, drop_whitespace=False)
    body = "".join(f"{pad}    {literal(piece)}\n" for piece in pieces)
    return f"{source.head}(\n{body}{pad})"


def assigned(target: str, value: str, indent: int) -> str:
    """Return an assignment; a long value is put in brackets."""
    line = f"{target} = {value}"
    if indent + width(line) <= WIDTH:
        return line
    pad = " " * indent
    return f"{target} = (\n{pad}    {value}\n{pad})"


def unpacked(targets: Sequence[str], value: str, indent: int) -> str:
    """Return the assignment of a tuple; a long list of targets is put in brackets."""
    if len(targets) == 1:
        return f"({targets[0]},) = {value}"
    line = f"{', '.join(targets)} = {value}"
    if indent + width(line) <= WIDTH:
        return line
    return laid_out(call("", targets, f" = {value}", broken=True), indent)


def either(conditions: Sequence[str], indent: int) -> str:
    """Return the head of an ``if`` whose conditions are joined by ``or``."""
    line = f"if {' or '.join(conditions)}:"
    if indent + width(line) <= WIDTH:
        return line
    pad = " " * indent
    return f"if (\n{pad}    " + f"\n{pad}    or ".join(conditions) + f"\n{pad}):"


def natural(name: str) -> list[str | int]:
    """Return a key that sorts ``Bay2`` before ``Bay10``."""
    return [int(part) if part.isdigit() else part for part in re.split(r"([0-9]+)", name)]


def exported(names: Iterable[str]) -> str:
    """Return the assignment of ``__all__``, sorted as a linter does: constants, classes, functions."""

    def rank(name: str) -> tuple[int, list[str | int], str]:
        kind = 0 if name.isupper() else 1 if name[:1].isupper() else 2
        return kind, natural(name), name

    quoted = tuple(literal(name) for name in sorted(names, key=rank))
    return laid_out(Nested("__all__ = [", quoted, "]"), 0)


def imported(module: str, names: Iterable[str], indent: int = 0) -> str:
    """Return an import statement, with the names in a linter's order, in brackets if it is long."""

    def rank(name: str) -> tuple[int, list[str | int], str]:
        kind = 0 if name.isupper() and len(name) > 1 else 1 if name[:1].isupper() else 2
        return kind, natural(name.lower()), name

    names = sorted(names, key=rank)
    renamed = [name for name in names if " as " in name]  # a linter puts each in its own statement
    if renamed and len(names) > 1:
        plain = [name for name in names if name not in renamed]
        groups = [*([name] for name in renamed), *([plain] if plain else [])]
        groups.sort(key=lambda group: rank(group[0]))
        return "\n".join(imported(module, group, indent) for group in groups)
    line = f"from {module} import {', '.join(names)}"
    if indent + len(line) <= WIDTH:
        return line
    return laid_out(call(f"from {module} import ", names, broken=True), indent)


FUNCTIONS: Final[Mapping[str, Callable[..., object]]] = {
    function.__name__: function
    for function in (
        assigned, call, either, exported, imported, laid_out, listed, literal, mapping, slots, strings,
        unpacked,
    )
}  # fmt: skip
"""The functions that templates of Python modules can call, by name."""

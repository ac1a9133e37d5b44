"""Python as text: displays, calls, literals and docstrings in their final formatting."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Final

from stagewire_generator.model import (
    Enumeration,
    Erratum,
    Field,
    FlagTable,
    Layout,
    Message,
    Protocol,
)
from stagewire_generator.naming import camel
from stagewire_generator.targets import documentation
from stagewire_generator.targets.documentation import (
    DIRECTIONS,
    Markup,
    command_paragraphs,
    errata_of,
    erratum_text,
    field_facts,
    message_paragraphs,
)
from stagewire_generator.targets.templates import wrapped

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


def _class(table: Enumeration | FlagTable) -> str:
    return f":class:`~.{camel(table.name)}`"


MARKUP = Markup(name=lambda name: f"``{name}``", table=_class)


def class_doc(
    first: str,
    paragraphs: Iterable[str],
    fields: Iterable[Field] = (),
    errata: Iterable[Erratum] = (),
) -> str:
    """Return the docstring of a message class, escaped.

    :param first: the first line: what it is, which way it goes, how long it is.
    :param paragraphs: what follows; empty ones are left out.
    :param errata: those of the message.
    """
    parts = [first, *(paragraph(text, 4) for text in paragraphs if text)]
    lines = [
        paragraph(f":param {field.name}: {field_facts(field, MARKUP)}.", 4, 4) for field in fields
    ]
    lines_of_errata = [paragraph(erratum_text(e, MARKUP), 4, 4) for e in errata]
    parts += ["\n    ".join(block) for block in (lines, lines_of_errata) if block]
    return docstring("\n\n    ".join(parts))


def message_doc(
    protocol: Protocol, message: Message, layout: Layout | None, named: str, size: str
) -> str:
    """Return the docstring of a class of a message, escaped.

    :param layout: the layout that the class is for; None where the message has none.
    :param named: the message and its id.
    :param size: how long it is, in words.
    """
    first = f"{named}, {DIRECTIONS[message.direction]}, {size}"
    if not message.overlay:  # two names make a line long
        first += f"; {where(protocol, message.pages)}"
    return class_doc(
        f"{first}.",
        message_paragraphs(protocol, message, layout, MARKUP),
        layout.all_fields if layout else (),
        errata_of(protocol, message.errata),
    )


def command_doc(protocol: Protocol, message: Message, layout: Layout, first: str) -> str:
    """Return the docstring of a class of a command or a setup command, escaped."""
    dummy = "A dummy function: refused unless ``allow_dummy`` is given."
    return class_doc(
        first,
        command_paragraphs(protocol, message, layout, MARKUP, dummy),
        layout.fields,
        errata_of(protocol, message.errata),
    )


def where(protocol: Protocol, pages: Sequence[int], overlay: str = "") -> str:
    """Return where in the document something stands, as a docstring names it."""
    return documentation.where(protocol, pages, MARKUP, overlay)

"""Python as text: literals and docstrings, escaped for the place where they go."""

from __future__ import annotations

import re
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


SUPPORT: Final = "stagewire.support"
"""The one module of the runtime that a package imports."""


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

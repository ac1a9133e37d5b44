"""Python source text: literals and docstrings, escaped for their place."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from typing import Final

from stagewire_generator.model import Erratum, Layout, Message, Protocol
from stagewire_generator.model_fields import Enumeration, Field, FlagTable
from stagewire_generator.naming import camel
from stagewire_generator.targets.documentation import (
    DIRECTIONS,
    Markup,
    command_paragraphs,
    errata_of,
    erratum_text,
    field_facts,
    first_sentence,
    message_paragraphs,
    where,
)
from stagewire_generator.targets.templates import wrapped

WIDTH = 100


def literal(text: str) -> str:
    """Return a string literal with the quotes that a formatter would choose."""
    if '"' not in text and "\\" not in text and text.isprintable():
        return f'"{text}"'  # nearly all of them
    quote = "'" if text.count('"') > text.count("'") else '"'
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
    """Return the width of a line as a formatter counts it: 2 for wide characters, 0 for accents."""
    if source.isascii():
        return len(source)
    return sum(
        0 if unicodedata.combining(c) else 1 + (unicodedata.east_asian_width(c) in "WF")
        for c in source
    )


def integer(value: int) -> str:
    """Return an integer literal: in hex for masks and the limits of a width."""
    if value in (0xFF, 0xFFFF, 0xFFFFFFFF, 0x7FFFFFFF, 0x7FFF, -0x8000, -0x80000000):
        return f"-{-value:#X}".replace("X", "x") if value < 0 else f"0x{value:X}"
    return str(value)


def paragraph(text: str, indent: int, hanging: int = 0) -> str:
    """Wrap a text for a docstring; the first line is not indented."""
    pad = " " * indent
    return f"\n{pad}".join(wrapped(text, WIDTH - indent, hanging))


def docstring(text: str) -> str:
    """Escape a text for a triple-quoted docstring. Formatters remove white space at its beginning."""
    escaped = re.sub(r"\A[^\S\n]+", "", text).replace("\\", "\\\\")
    if '"' not in escaped:
        return escaped
    return re.sub(r'\A"+|"{3,}|"+\Z', lambda quotes: '\\"' * len(quotes[0]), escaped)


SUPPORT: Final = "stagewire.support"
"""The only module of the runtime that a package imports."""


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

    :param first: the first line.
    :param paragraphs: the paragraphs that follow; empty ones are left out.
    :param errata: the errata of the message.
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
    """Return the docstring of a message class, escaped.

    :param layout: the layout of the class; None if the message has none.
    :param named: the message and its id.
    :param size: its length in words.
    """
    found = where(protocol, message.pages, message.overlay)
    facts = f"{named}, {DIRECTIONS[message.direction]}, {size}; {found}."
    paragraphs = message_paragraphs(protocol, message, layout, MARKUP, facts)
    return class_doc(
        *opened(paragraphs),
        layout.all_fields if layout else (),
        errata_of(protocol, message.errata),
    )


def command_doc(protocol: Protocol, message: Message, layout: Layout, facts: str) -> str:
    """Return the docstring of a class of a command or a setup command, escaped.

    :param facts: its name, bytes and length; the beginning of a sentence.
    """
    dummy = "A dummy function: refused unless ``allow_dummy`` is given."
    return class_doc(
        *opened(command_paragraphs(protocol, message, layout, MARKUP, facts, dummy)),
        layout.fields,
        errata_of(protocol, message.errata),
    )


def opened(paragraphs: Iterable[str], indent: int = 4) -> tuple[str, list[str]]:
    """Return the first line of a docstring, and the paragraphs after it.

    The first line is the first sentence of the first paragraph. If that is too long for a line, the line
    is the first sentence of the second paragraph instead.

    :param indent: number of spaces before the docstring.
    """
    texts = list(paragraphs)
    for index in (0, 1):
        head, rest = first_sentence(texts[index])
        if indent + len('"""') + len(docstring(head)) <= WIDTH:
            return head, [*texts[:index], rest, *texts[index + 1 :]]
    return texts[0], texts[1:]

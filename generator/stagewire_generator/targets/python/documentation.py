"""What the docstrings of generated classes say."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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
from stagewire_generator.targets.python.source import docstring, paragraph

__all__ = ["MARKUP", "class_doc", "command_doc", "message_doc", "where"]


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

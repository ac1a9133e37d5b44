"""What the comments in the headers say."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.model import Enumeration, Field, FlagTable, Layout, Message, Protocol
from stagewire_generator.targets import documentation
from stagewire_generator.targets.c.names import Names
from stagewire_generator.targets.c.source import comment
from stagewire_generator.targets.documentation import (
    DIRECTIONS,
    Markup,
    errata_of,
    erratum_text,
    field_facts,
    message_paragraphs,
)

__all__ = ["field_doc", "markup_of", "message_doc", "where"]


def markup_of(names: Names) -> Markup:
    """Return how the comments of a package write names: as its code does."""

    def table(table: Enumeration | FlagTable) -> str:
        name = names.table(table)
        if isinstance(table, FlagTable):
            return f"bits {name.upper()}_..."
        return f"see enum {name}"

    return Markup(name=str, table=table)


def message_doc(
    names: Names, protocol: Protocol, message: Message, layout: Layout | None, size: str
) -> str:
    """Return the comment on the type of a layout.

    :param layout: None where the message has none.
    :param size: how long it is, in words.
    """
    markup = markup_of(names)
    id = f"0x{message.id:0{protocol.id_digits}X}"
    first = f"{message.name} ({id}), {DIRECTIONS[message.direction]}, {size}"
    if not message.overlay:
        first += f"; {where(protocol, message.pages)}"
    return comment([
        f"{first}.",
        *message_paragraphs(protocol, message, layout, markup),
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, message.errata)),
    ])  # fmt: skip


def field_doc(names: Names, field: Field) -> str:
    """Return the comment on a member."""
    return comment([documentation.sentence(field_facts(field, markup_of(names)))], 4)


def where(protocol: Protocol, pages: Sequence[int], overlay: str = "") -> str:
    """Return where in the document something stands, as a comment names it."""
    return documentation.where(protocol, pages, Markup(str, lambda table: table.name), overlay)

"""Enumerations and flag tables."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Enumeration, FlagTable, Protocol
from stagewire_generator.targets.c.documentation import where
from stagewire_generator.targets.c.names import Names
from stagewire_generator.targets.c.source import (
    comment,
    comment_lines,
    integer,
    plain,
    unsigned,
)
from stagewire_generator.targets.documentation import sentence

__all__ = ["MemberView", "TableView", "enumeration_view", "flag_table_view"]

_ENUM_LEAST, _ENUM_GREATEST = -0x8000, 0x7FFF  # what an int holds wherever there is C


@dataclass(frozen=True, slots=True)
class MemberView:
    """A named value, or a bit; ``doc`` may be empty."""

    name: str
    value: str
    doc: str


@dataclass(frozen=True, slots=True)
class TableView:
    """An enumeration or a flag table.

    :param is_enum: whether it is an ``enum``; else its comment begins a group of macros.
    """

    name: str
    doc: str
    members: tuple[MemberView, ...]
    is_enum: bool


def enumeration_view(names: Names, protocol: Protocol, enumeration: Enumeration) -> TableView:
    """Make the view of an enumeration: an ``enum`` if its values are such everywhere, else macros."""
    name, head = names.table(enumeration), _head(protocol, "Values", enumeration)
    values = [value.value for value in enumeration.values]
    if all(_ENUM_LEAST <= value <= _ENUM_GREATEST for value in values):
        members = tuple(
            MemberView(
                name=f"{name}_{value.name}".upper(),
                value=str(value.value),
                doc=comment([sentence(value.note)], 4) if value.note else "",
            )
            for value in enumeration.values
        )
        return TableView(name, comment([f"{head}.", enumeration.summary]), members, is_enum=True)
    signed = min(values) < 0
    size = 4 if max(values) < 1 << (32 - signed) and min(values) >= -(1 << 31) else 8
    members = tuple(
        MemberView(
            name=f"{name}_{value.name}".upper(),
            value=integer(value.value, size, signed),
            doc=_numbered("Value", value.value, value.note),
        )
        for value in enumeration.values
    )
    return TableView(name, _group(head, enumeration.summary), members, is_enum=False)


def flag_table_view(names: Names, protocol: Protocol, table: FlagTable) -> TableView:
    """Make the view of a flag table: a macro a bit."""
    name, size = names.table(table), table.format.size
    members = tuple(
        MemberView(
            name=f"{name}_{bit.name}".upper(),
            value=unsigned(bit.mask, size, 2 * size),
            doc=_numbered("Bit", bit.bit, bit.note),
        )
        for bit in table.bits
    )
    doc = _group(_head(protocol, "Bits", table), table.summary)
    return TableView(name, doc, members, is_enum=False)


def _head(protocol: Protocol, kind: str, table: Enumeration | FlagTable) -> str:
    return f"{kind} of {table.name} ({where(protocol, [table.page], table.overlay)})"


def _numbered(kind: str, number: int, note: str) -> str:
    """Return the comment on a macro, which has one even where the document says no more of it."""
    return comment([sentence(f"{kind} {number}: {note}" if note else f"{kind} {number}")])


def _group(head: str, summary: str) -> str:
    """Return the comment that begins a group of macros; the template ends it."""
    lines = [f" * @name {plain(head)}", *([" *", *comment_lines([summary])] if summary else ())]
    return "\n".join(["/**", *lines, " * @{", " */"])

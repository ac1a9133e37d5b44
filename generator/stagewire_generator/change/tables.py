"""Enumerations and flag tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from stagewire_generator.change.comparison import Comparison
from stagewire_generator.change.pairing import Pairs, pair
from stagewire_generator.model import Enumeration, EnumValue, FlagBit, FlagTable

__all__ = ["compare_tables"]

Table = TypeVar("Table", Enumeration, FlagTable)
Member = TypeVar("Member", EnumValue, FlagBit)


def compare_tables(comparison: Comparison) -> None:
    """Compare the enumerations and their values, the flag tables and their bits."""
    enumerations, flags = comparison.matches.enumeration, comparison.matches.flags
    _compare(
        comparison, "enumeration", enumerations, "value", lambda e: e.values, lambda v: v.value
    )
    _compare(comparison, "flags", flags, "bit", lambda t: t.bits, lambda b: b.bit)


def _compare(
    comparison: Comparison,
    noun: str,
    tables: Pairs[Table],
    member: str,
    members: Callable[[Table], tuple[Member, ...]],
    number: Callable[[Member], int],
) -> None:
    """Compare tables of one kind; a member under another name is the one with the same number."""
    comparison.names(noun, noun, tables)
    for old, new in tables.kept:
        where = {noun: new.name}
        comparison.attributes(where, old, new)
        if old.open != new.open:
            kind = "text" if old.open and new.open else f"{noun}-open"
            comparison.add(kind, {**where, "attribute": "open"}, old.open, new.open)
        pairs = pair({m.name: m for m in members(old)}, {m.name: m for m in members(new)}, number)
        comparison.names(member, member, pairs, where)
        for before, after in pairs.kept:
            comparison.attributes({**where, member: after.name}, before, after)
        if pairs.reordered:
            comparison.add("order", {**where, "attribute": f"{member}s"})

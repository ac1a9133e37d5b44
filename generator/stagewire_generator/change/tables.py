"""Enumerations and flag tables."""

from __future__ import annotations

from stagewire_generator.change.comparison import Comparison
from stagewire_generator.change.pairing import pair

__all__ = ["compare_tables"]


def compare_tables(comparison: Comparison) -> None:
    """Compare the enumerations and their values, the flag tables and their bits."""
    enumerations = comparison.matches.enumeration
    comparison.names("enumeration", "enumeration", enumerations)
    for old, new in enumerations.kept:
        where = {"enumeration": new.name}
        comparison.attributes(where, old, new)
        values = pair(
            {value.name: value for value in old.values},
            {value.name: value for value in new.values},
            lambda value: value.value,
        )
        comparison.names("value", "value", values, where)
        for before, after in values.kept:
            comparison.attributes({**where, "value": after.name}, before, after)
        if values.reordered:
            comparison.add("order", {**where, "attribute": "values"})
    tables = comparison.matches.flags
    comparison.names("flags", "flags", tables)
    for table, other in tables.kept:
        where = {"flags": other.name}
        comparison.attributes(where, table, other)
        bits = pair(
            {bit.name: bit for bit in table.bits},
            {bit.name: bit for bit in other.bits},
            lambda bit: bit.bit,
        )
        comparison.names("bit", "bit", bits, where)
        for one, two in bits.kept:
            comparison.attributes({**where, "bit": two.name}, one, two)
        if bits.reordered:
            comparison.add("order", {**where, "attribute": "bits"})

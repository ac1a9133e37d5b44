"""One field: format, range, quantity and the tables that name its values."""

from __future__ import annotations

from stagewire_generator.change.comparison import Comparison, Where
from stagewire_generator.change.exact import same_scale
from stagewire_generator.model import Field

__all__ = ["compare_field"]


def compare_field(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    """Compare a field that is on both sides; its name is compared by the caller."""
    comparison.attributes(where, old, new)
    _format(comparison, where, old, new)
    _range(comparison, where, old, new)
    _quantity(comparison, where, old, new)
    by_unit = {u: comparison.renamed("flags", t.name) for u, t in old.flags_by_unit.items()}
    if by_unit != {unit: table.name for unit, table in new.flags_by_unit.items()}:
        before, after = (
            {unit: table.name for unit, table in sorted(field.flags_by_unit.items())}
            for field in (old, new)
        )
        comparison.add("field-flags-by-unit", where, before, after)


def _format(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    before, after = old.format, new.format
    if before == after:
        return
    if (before.size, before.signed) == (after.size, after.signed):
        if before.kind == after.kind:
            kind = "field-format-name"
        elif "integer" in (before.kind, after.kind):
            kind = "field-format"
        else:
            kind = "field-type"
    else:
        kind = "field-format"
    names = [before.name, after.name]
    if before.name == after.name:  # the table of formats says something else of it now
        names = [
            f"{f.name} ({f.size} bytes, {'un' * (not f.signed)}signed)" for f in (before, after)
        ]
    comparison.add(kind, where, *names)


def _range(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    if old.format != new.format and not (old.ranged or new.ranged):
        return  # the range is that of the format
    if (old.minimum, old.maximum) != (new.minimum, new.maximum):
        ends = (f"{field.minimum} to {field.maximum}" for field in (old, new))
        comparison.add("field-range", where, *ends)


def _quantity(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    before, after = old.quantity, new.quantity
    if before is None and after is None:
        return
    if before and after:
        if comparison.renamed("quantity", before.name) == after.name:
            return  # what changed in it is reported with the quantity
        kind = "field-quantity" if same_scale(before, after) else "field-scale"
        comparison.add(kind, where, before.name, after.name)
    else:
        comparison.add("field-quantity", where, before and before.name, after and after.name)

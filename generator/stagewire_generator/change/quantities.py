"""Compare tables of values, quantities, stages and controllers.

The same value in a unit should give the same bytes in both registries.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from stagewire_generator.change.attributes import SCALE
from stagewire_generator.change.comparison import Comparison, Where
from stagewire_generator.change.matching import Pairs, Scale, known, pair, scales_on
from stagewire_generator.model import Json
from stagewire_generator.model_fields import Enumeration, EnumValue, FlagBit, FlagTable
from stagewire_generator.model_scales import (
    Factor,
    Limit,
    Stage,
    StageId,
)

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
    """Compare tables of one kind; members are paired by name, or else by number."""
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


def compare_scales(comparison: Comparison) -> None:
    """Compare everything that converts counts to engineering units."""
    matches = comparison.matches
    comparison.names("quantity", "quantity", matches.quantity)
    for old, new in matches.quantity.kept:
        where = {"quantity": new.name}
        comparison.attributes(where, old, new)
        _scale(comparison, where, old.factor or old.rule, new.factor or new.rule)
    comparison.names("controller", "controller", matches.controller)
    for before, after in matches.controller.kept:
        where = {"controller": after.name}
        comparison.attributes(where, before, after)
        for unit in sorted(set(before.members) - set(after.members)):
            comparison.add("controller-unit-removed", {**where, "unit": unit}, unit, None)
        for unit in sorted(set(after.members) - set(before.members)):
            comparison.add("controller-unit-added", {**where, "unit": unit}, None, unit)
        if before.units != after.units and set(before.units) == set(after.units):
            comparison.add("order", {**where, "attribute": "units"}, before.units, after.units)
        for alias in sorted(before.aliases.keys() & after.aliases.keys()):
            if before.aliases[alias] != after.aliases[alias]:
                at = {**where, "unit": alias, "attribute": "source"}
                comparison.add("scale-note", at, before.aliases[alias], after.aliases[alias])
    comparison.names("stage", "stage", matches.stage)
    for one, other in matches.stage.kept:
        where = {"stage": other.name}
        comparison.attributes(where, one, other)
        _stage(comparison, where, one, other)
        for name in (*one.limits, *(name for name in other.limits if name not in one.limits)):
            _limit(
                comparison, {**where, "limit": name}, one.limits.get(name), other.limits.get(name)
            )
        for name in (*one.ids, *(name for name in other.ids if name not in one.ids)):
            _id(comparison, {**where, "field": name}, one.ids.get(name), other.ids.get(name))


def _stage(comparison: Comparison, where: Where, old: Stage, new: Stage) -> None:
    before = {
        (
            comparison.renamed("controller", key.controller),
            comparison.renamed("quantity", key.quantity),
            key.source,
        ): scale
        for key, scale in scales_on(old)
    }
    after = {(*key,): scale for key, scale in scales_on(new)}
    for key in (*before, *(key for key in after if key not in before)):
        at = {**where, "controller": key[0], "quantity": key[1]}
        if key[2]:
            at["source"] = key[2]
        _scale(comparison, at, before.get(key), after.get(key))


def _limit(
    comparison: Comparison, where: Where, old: Limit | str | None, new: Limit | str | None
) -> None:
    """Compare two limits of a stage; an unknown limit is a reason, or None."""
    if isinstance(old, Limit) and isinstance(new, Limit):
        comparison.attributes(where, old, new)
        return
    before, after = (_limited(limit) if isinstance(limit, Limit) else limit for limit in (old, new))
    if before != after:
        known = isinstance(old, Limit) or isinstance(new, Limit)
        comparison.add("stage-limit" if known else "limit-note", where, before, after)


def _id(comparison: Comparison, where: Where, old: StageId | None, new: StageId | None) -> None:
    """Compare the numbers of a stage in a field, one of which may be missing."""
    if old and new:
        comparison.attributes(where, old, new)
    else:
        comparison.add("stage-id", where, old and old.id, new and new.id)


def _limited(limit: Limit) -> str:
    return "endless" if limit.value is None else f"{limit.value} {limit.unit}"


def _scale(comparison: Comparison, where: Where, old: Scale, new: Scale) -> None:
    """Compare two scales, one or both of which may be missing."""
    if not known(old) and not known(new):
        _unknown(comparison, where, old, new)
    elif not known(new):
        comparison.add("scale-removed", where, _shown(old), _shown(new))
    elif not known(old):
        comparison.add("scale-added", where, _shown(old), _shown(new))
    elif isinstance(old, Factor) and isinstance(new, Factor):
        if old.counts_per_unit != new.counts_per_unit:
            comparison.add("scale", where, _shown(old), _shown(new))
        elif old.key != new.key:
            comparison.add("scale-form", where, _shown(old), _shown(new))
        comparison.attributes(where, old, new)
    elif isinstance(old, dict) and isinstance(new, dict) and old["by"] == new["by"]:
        _rule(comparison, where, old, new)
    else:
        comparison.add("scale", where, _shown(old), _shown(new))


def _unknown(comparison: Comparison, where: Where, old: Scale, new: Scale) -> None:
    before, after = _shown(old), _shown(new)
    if (before is None) != (after is None):
        comparison.add("scale-refusal", where, before, after)
    elif before != after:
        comparison.add("scale-note", {**where, "attribute": "unknown"}, before, after)
    if isinstance(old, dict) and isinstance(new, dict):
        _facts(comparison, where, old, new)


def _rule(comparison: Comparison, where: Where, old: Json, new: Json) -> None:
    _facts(comparison, where, old, new)
    for unit in _keys(old, new, "units"):
        factors = (rule.get("units", {}).get(unit) for rule in (old, new))
        _scale(comparison, {**where, "unit": unit}, *factors)
    for name in _keys(old, new, "cases"):
        at = {**where, "case": name}
        before, after = (rule.get("cases", {}).get(name, {}) for rule in (old, new))
        if before and after and before["unit"] != after["unit"]:
            comparison.add("quantity-unit", at, before["unit"], after["unit"])
        _scale(comparison, at, before.get("scale"), after.get("scale"))
        if before and after and _range(before) != _range(after):
            comparison.add("field-range", at, _range(before), _range(after))


def _range(case: Json) -> str | None:
    return f"{case['minimum']} to {case['maximum']}" if "minimum" in case else None


def _facts(comparison: Comparison, where: Where, old: Json, new: Json) -> None:
    for key in (*old, *(key for key in new if key not in old)):
        attribute = SCALE.get(key, "unclassified")
        comparison.attribute(where, key, attribute, old.get(key), new.get(key))


def _keys(old: Json, new: Json, section: str) -> list[str]:
    first, second = old.get(section, {}), new.get(section, {})
    return [*first, *(key for key in second if key not in first)]


def _shown(scale: Scale) -> str | None:
    if isinstance(scale, Factor):
        return f"{scale.key} {scale.value}"
    if isinstance(scale, dict):
        if "unknown" in scale:
            return f"unknown: {scale['unknown']}"
        by = scale.get("setting") or scale.get("by")
        return f"by {by}" if by else None
    return scale and f"unknown: {scale}"

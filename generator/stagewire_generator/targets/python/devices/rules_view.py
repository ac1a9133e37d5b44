"""Entries of the module of facts about scales: settings and what tells them, and the rules of quantities."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from stagewire_generator.model import Factor, Json, Protocol
from stagewire_generator.targets.python.devices.nested import Nested, Source
from stagewire_generator.targets.python.devices.tables_view import class_of
from stagewire_generator.targets.python.source import literal, long_text

__all__ = ["alias_entries", "prefixes_of", "quantity_entries", "reported_as", "setting_entries"]


def setting_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each setting that decides on a scale."""
    return tuple(_setting(protocol, name, entry) for name, entry in protocol.settings.items())


def quantity_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each quantity: the rule of its scale."""
    quantities = sorted(protocol.quantities, key=lambda quantity: quantity.name)
    return tuple(_keyed(literal(q.name), _rule(q.factor or q.rule, q.unit)) for q in quantities)


def alias_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each unit that is newer than the document."""
    return tuple(
        Nested(f"{literal(name)}: Alias(", tuple(_alias(protocol, name, entry)), ")")
        for name, entry in protocol.units.get("aliases", {}).items()
    )


def prefixes_of(protocol: Protocol, name: str, entry: Json) -> Iterator[Source]:
    """Yield the prefixes of the serial numbers of a unit or alias, if any is known."""
    printed = {entry[key] for key in ("usb_prefix", "card_usb_prefix") if key in entry}
    known = {
        int(prefix)
        for prefix, found in protocol.units.get("known_prefixes", {}).items()
        if name in (found["unit"], *found.get("shared_with", ()))
    }
    if printed | known:
        yield Nested("prefixes=(", tuple(map(str, sorted(printed | known))), ")")


def reported_as(entry: Json) -> Iterator[Source]:
    """Yield the models that a unit or alias reports besides its name, if any is known."""
    if "reported_as" in entry:
        yield Nested("reported_as=(", tuple(map(literal, entry["reported_as"])), ")")


def _setting(protocol: Protocol, name: str, entry: Json) -> Nested:
    unit = entry.get("unit", "")
    told = [_told(protocol, unit, *teller) for teller in entry["told_by"].items()]
    items = (literal(name), literal(unit), Nested("(", tuple(told), ")"))
    return Nested(f"{literal(name)}: Setting(", items, ")")


def _told(protocol: Protocol, unit: str, owner: str, teller: Json) -> Nested:
    """Return a set that tells a setting: its messages, its field, and what that holds."""
    messages = {m.set[1]: m for m in protocol.messages if m.set and m.set[0] == owner}
    items: list[Source] = []
    for role in ("set", "req", "get"):
        member = messages.get(role)
        items.append(f"{role}={class_of(member, member.layouts[0])}" if member else f"{role}=None")
    items.append(f"field={literal(teller['field'])}")
    content = messages.get("get") or messages["set"]
    field = next(f for f in content.layouts[0].all_fields if f.name == teller["field"])
    if field.enum:
        values = teller.get("values", {})
        named = [v for v in field.enum.values if not unit or v.name in values]
        pairs = [
            f"0x{v.value:02X}: {_number(values[v.name]) if unit else literal(v.name)}"
            for v in named
        ]
        items.append(Nested("values={", tuple(pairs), "}"))
    elif field.quantity:
        items.append(f"scale=quantities.{field.quantity.name.upper()}")
    return Nested("Told(", tuple(items), ")")


def _number(value: int | str) -> str:
    """Return an exact value: an integer, or a fraction."""
    exact = Fraction(value)
    if exact.denominator == 1:
        return str(exact.numerator)
    return f"Fraction({exact.numerator}, {exact.denominator})"


def _rule(rule: Factor | Json, unit: str) -> Source:
    """Return the rule of a scale."""
    if isinstance(rule, Factor):
        method = "unit_per" if rule.key.endswith("_per_count") else "counts_per"
        items = [literal(unit), str(rule.value.numerator), str(rule.value.denominator)]
        items += [
            f"{key}={literal(text)}"
            for key, text in (("printed", rule.printed), ("source", rule.source))
            if text
        ]
        return Nested(f"Scale.{method}(", tuple(items), ")")
    if "unknown" in rule:
        return Nested("UnknownScale(", (literal(unit), literal(rule["unknown"])), ")")
    if rule["by"] == "stage":
        return f"ByStage({literal(unit)})"
    if rule["by"] == "unit":
        units = [
            _keyed(literal(name), _rule(factor, unit)) for name, factor in rule["units"].items()
        ]
        return Nested("ByUnit(", (Nested("{", tuple(units), "}"), literal(unit)), ")")
    if "cases" in rule:
        cases = [
            _keyed(literal(name), _rule(case["scale"], case["unit"]))
            for name, case in rule["cases"].items()
        ]
        return Nested("ByCase(", (literal(rule["setting"]), Nested("{", tuple(cases), "}")), ")")
    return Nested(
        "BySetting(", (literal(rule["setting"]), str(rule["counts_at_setting"]), literal(unit)), ")"
    )


def _keyed(key: str, value: Source) -> Source:
    if isinstance(value, str):
        return f"{key}: {value}"
    return Nested(f"{key}: {value.opening}", value.items, value.closing)


def _alias(protocol: Protocol, name: str, entry: Json) -> Iterator[Source]:
    yield literal(name)
    yield long_text("", entry.get("title", ""), 8)
    if "like" in entry:
        yield f"like={literal(entry['like'])}"
    if "source" in entry:
        yield long_text("source=", entry["source"], 8)
    yield from prefixes_of(protocol, name, entry)
    yield from reported_as(entry)
    groups = {c.name: c.aliases[name] for c in protocol.controllers if name in c.aliases}
    if groups:
        scales = tuple(
            long_text(f"{literal(group)}: ", source, 12) for group, source in groups.items()
        )
        yield Nested("scales={", scales, "}")

"""The model as plain data: every factor is a numerator and a denominator."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from fractions import Fraction
from functools import lru_cache
from typing import TypeAlias

from stagewire_generator.model import (
    Chapter,
    Erratum,
    Firmware,
    Json,
    Layout,
    Message,
    Protocol,
    Rule,
)
from stagewire_generator.model_fields import (
    Array,
    Enumeration,
    EnumValue,
    Field,
    FlagBit,
    FlagTable,
)
from stagewire_generator.model_scales import (
    Conflict,
    Controller,
    Factor,
    Limit,
    Quantity,
    Stage,
    StageId,
)
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.registry.references import with_documents, with_evidence
from stagewire_generator.targets.templates import canonical


def scale_json(quantity: Quantity) -> Json:
    """Return the scale of a quantity: its factor, or what it depends on."""
    return factor_json(quantity.factor) if quantity.factor else _scale_rule(quantity.rule)


def factor_json(factor: Factor) -> Json:
    """Return an exact factor and its source."""
    data: Json = {factor.key: _rational(factor.value)}
    if factor.printed:
        data["printed"] = factor.printed
    if factor.source:
        data["source"] = factor.source
    if factor.page is not None:
        data["page"] = factor.page
    if factor.note:
        data["note"] = factor.note
    return data


def limit_json(limit: Limit | str) -> Json:
    """Return a limit of a stage and its source, or the reason why it is unknown."""
    if isinstance(limit, str):
        return {"unknown": limit}
    data: Json = {"endless": True}
    if limit.value is not None:
        data = {"value": _rational(limit.value), "unit": limit.unit}
    if limit.source:
        data["source"] = limit.source
    if limit.page is not None:
        data["page"] = limit.page
    if limit.note:
        data["note"] = limit.note
    return data


def _scale_rule(rule: Json) -> Json:
    if "units" in rule:
        return {
            **rule,
            "units": {unit: factor_json(factor) for unit, factor in rule["units"].items()},
        }
    if "cases" in rule:
        cases = {
            name: {**case, "scale": _case(case["scale"])} for name, case in rule["cases"].items()
        }
        return {**rule, "cases": cases}
    return rule


def _case(scale: Factor | Json) -> Json:
    return factor_json(scale) if isinstance(scale, Factor) else _scale_rule(scale)


def _rational(value: Fraction) -> Json:
    return {"numerator": value.numerator, "denominator": value.denominator}


def setting_json(setting: Json) -> Json:
    """Return a setting and the parameter sets that report it."""
    tellers = {
        name: {
            key: {n: _rational(Fraction(v)) for n, v in fact.items()} if key == "values" else fact
            for key, fact in teller.items()
        }
        for name, teller in setting["told_by"].items()
    }
    return {**setting, "unit": setting.get("unit"), "told_by": tellers}


SCHEMA_VERSION = 1
_Registered: TypeAlias = (
    Chapter
    | Controller
    | Enumeration
    | Erratum
    | Field
    | FlagTable
    | Message
    | Quantity
    | Rule
    | Stage
)
_TABLES_OF_UNITS = ("families", "lists", "addresses", "hardware_types")
_LONG_LISTS = ("errata", "messages", "rules", "stages", "units")


def render(protocol: Protocol) -> dict[str, str]:
    """Return the file of the registry."""
    return {f"registry/{protocol.name}.json": registry_text(protocol)}


@lru_cache(maxsize=1)
def registry_text(protocol: Protocol) -> str:
    """Return the resolved registry as canonical JSON, which the Python package also contains."""
    data = with_documents(protocol, with_evidence(protocol, _registry_json(protocol)))
    return canonical(data, lines=_LONG_LISTS)


def _registry_json(protocol: Protocol) -> Json:
    """Return the resolved registry as the architecture describes it."""
    units, uncompared = protocol.units, protocol.not_compared
    later = protocol.later_messages
    applied = {overlay.name for overlay in protocol.overlays}
    return {
        "schema_version": SCHEMA_VERSION,
        "protocol": protocol.name,
        "title": protocol.title,
        "document": _document(protocol),
        "framing": protocol.framing,
        "firmware": _firmware(protocol.firmware),
        "chapters": [
            {"name": c.name, "title": c.title, "page": c.page, "summary": c.summary, **_from(c)}
            for c in protocol.chapters
        ],
        "messages": [_message(message, applied) for message in protocol.messages],
        "sets": {s.name: dict(s.members) for s in protocol.sets},
        "enumerations": {
            e.name: {
                "page": e.page,
                "summary": e.summary,
                "values": {value.name: _value(value) for value in e.values},
                **_open(e),
                **_from(e),
            }
            for e in protocol.enumerations
        },
        "flags": {
            t.name: {
                "page": t.page,
                "summary": t.summary,
                "format": t.format.name,
                "bits": {b.name: _bit(b) for b in t.bits},
                **_open(t),
                **_from(t),
            }
            for t in protocol.flags
        },
        "quantities": {
            q.name: {
                "unit": q.unit or None,
                **({"rotary_unit": q.rotary_unit} if q.rotary_unit else {}),
                "page": q.page,
                "summary": q.summary,
                "scale": scale_json(q),
                **_from(q),
            }
            for q in protocol.quantities
        },
        "settings": {name: setting_json(s) for name, s in protocol.settings.items()},
        "controllers": {
            c.name: {"units": sorted(c.members), **_from(c)} for c in protocol.controllers
        },
        "stages": [_stage(stage) for stage in sorted(protocol.stages, key=lambda s: s.name)],
        "units": [
            {
                "name": name,
                **entry,
                "messages": sorted(protocol.messages_of(entry)),
                **({"later_messages": list(later[name])} if name in later else {}),
            }
            for name, entry in sorted(units.get("units", {}).items())
        ],
        **{key: units[key] for key in _TABLES_OF_UNITS if key in units},
        "aliases": units.get("aliases", {}),
        "known_prefixes": _prefixes(units),
        **({"unsupported": units["unsupported"]} if "unsupported" in units else {}),
        "errata": [
            {
                "id": e.id,
                "pages": list(e.pages),
                "subject": e.subject,
                "messages": list(e.messages),
                "printed": e.printed,
                "encoded": e.encoded,
                "evidence": e.evidence,
                "class": e.kind,
                "origin": e.origin,
                "compared": e.id not in uncompared,
                **_from(e),
            }
            for e in protocol.errata
        ],
        "rules": [_rule_entry(rule) for rule in protocol.rules],
    }


def _rule_entry(rule: Rule) -> Json:
    return {
        "id": rule.id,
        "page": rule.page,
        "also": list(rule.also),
        "strength": rule.strength,
        "subject": rule.subject,
        "states": rule.states,
        "means": rule.means,
        "messages": list(rule.messages),
        "errata": list(rule.errata),
        "waiver": rule.waiver,
        "sentences": [sentence._asdict() for sentence in rule.sentences],
        **_from(rule),
    }


def _document(protocol: Protocol) -> Json:
    """Return the document, with its overlays."""
    if not protocol.overlays:
        return protocol.document

    def named(overlay: str) -> Json:
        return {**protocol.document_of(overlay), "name": protocol.document_name(overlay)}

    overlays = [
        {"name": o.name, "title": o.title, "summary": o.summary, "document": named(o.name)}
        for o in protocol.overlays
    ]
    return {**named(""), "overlays": overlays}


def _from(thing: _Registered) -> Json:
    """Return the overlay of an item, or an empty object."""
    return {"overlay": thing.overlay} if thing.overlay else {}


def _open(table: Enumeration | FlagTable) -> Json:
    """Return the reason why a table may be incomplete, or an empty object."""
    return {"open": table.open} if table.open else {}


def _value(value: EnumValue) -> Json:
    data: Json = {"value": value.value, "note": value.note}
    if value.keyboard:
        data["keyboard"] = value.keyboard
    if value.reserved:
        data["reserved"] = True
    if value.modifier:
        data["modifier"] = True
    if value.hinders:
        data["hinders"] = value.hinders
    if value.symbol:
        data["symbol"] = value.symbol
    return data


def _bit(bit: FlagBit) -> Json:
    data: Json = {"bit": bit.bit, "mask": bit.mask, "note": bit.note}
    if bit.motion:
        data["motion"] = True
    if bit.hinders:
        data["hinders"] = bit.hinders
    if bit.symbol:
        data["symbol"] = bit.symbol
    return data


def _message(message: Message, applied: Collection[str]) -> Json:
    classes = message_classes(message)
    data = {
        "name": message.name,
        "kind": message.kind,
        "id": message.id,
        "chapter": message.chapter,
        "class": message.class_name,
        "words": list(message.words),
        "pages": list(message.pages),
        "direction": message.direction,
        "effect": message.effect or None,
        "summary": message.summary,
        "note": message.note,
        "set": {"name": message.set[0], "role": message.set[1]} if message.set else None,
        "exchange": message.exchange,
        "layouts": [_layout(layout, classes[layout.form]) for layout in message.layouts],
        "errata": list(message.errata),
        **_from(message),
    }
    optional = {
        "title": message.title,
        "hazard": message.hazard,
        "addressee": message.addressee,
        "tells": message.tells,
        "call": message.call,
        "aliases": list(message.aliases),
        "later_pages": {o: page for o, page in message.later_pages.items() if o in applied},
        "not_sent": message.not_sent,
        "without_flag": message.without_flag,
        "twin_of": message.twin_of,
    }
    data |= {key: value for key, value in optional.items() if value}
    if message.sub_message is not None:
        data["sub_message"] = message.sub_message
    if message.kind != "message":
        data |= {
            "keyboard": message.keyboard,
            "firmware": _firmware(message.firmware),
        }
    if message.kind == "command":
        data |= {"size": message.size, "dummy": message.dummy}
    if message.kind == "setup":
        data["switches_to"] = message.switches_to
    return data


def _firmware(facts: Iterable[Firmware]) -> list[Json]:
    return [{"version": fact.version, "note": fact.note, "page": fact.page} for fact in facts]


def _layout(layout: Layout, class_name: str) -> Json:
    return {
        "form": layout.form,
        "class": class_name,
        "when": dict(layout.when) or None,
        "param1": _field(layout.param1) if layout.param1 else None,
        "param2": _field(layout.param2) if layout.param2 else None,
        "length": layout.length,
        **({"longest": layout.longest} if layout.array else {}),
        "fields": [_field(field) for field in layout.fields],
        "note": layout.note,
        **({"only_zero": True} if layout.only_zero else {}),
        **({"sent_when": dict(layout.sent_when)} if layout.sent_when else {}),
    }


def _array(array: Array) -> Json:
    return {
        "item_size": array.item.size,
        "rows": array.rows,
        "columns": [
            {
                "name": column.name,
                "each": column.each or None,
                "quantity": column.quantity.name if column.quantity else None,
                "unit": (column.quantity.unit or None) if column.quantity else None,
                "note": column.note,
            }
            for column in array.columns
        ],
    }


def _field(field: Field) -> Json:
    data: Json = {
        "name": field.name,
        "offset": field.offset,
        "size": field.format.size,
        "format": field.format.name,
        "kind": field.format.kind,
        "signed": field.format.signed,
        "role": field.role,
        "unit": field.unit,
        "scale": scale_json(field.quantity) if field.quantity else None,
        "quantity": field.quantity.name if field.quantity else None,
        "minimum": field.minimum,
        "maximum": field.maximum,
        "default": field.default,
        "constant": field.constant,
        "page": field.page,
        "note": field.note,
        "errata": list(field.errata),
        **_from(field),
    }
    if field.format.kind != "integer":
        data["minimum"] = data["maximum"] = None
    if field.format.real:
        data["real"] = True
    if field.array:
        data |= {"minimum": field.minimum, "maximum": field.maximum, "array": _array(field.array)}
    if field.enum:
        data["enumeration"] = field.enum.name
        data["enum"] = {value.name: value.value for value in field.enum.values}
    if field.flags:
        data["flag_table"] = field.flags.name
        data["flags"] = {bit.name: bit.mask for bit in field.flags.bits}
    if field.target:
        data["target"] = field.target
    if field.enum and field.enum.modifiers:
        data["modifiers"] = [value.name for value in field.enum.modifiers]
    if (field.enum or field.flags) and not field.lists_all:
        data["open"] = True
    if field.enums_by_unit:
        data["enums_by_unit"] = {unit: table.name for unit, table in field.enums_by_unit.items()}
    if field.ranges_by_unit:
        ranges = {"others": field.own_range, **field.ranges_by_unit}
        data["ranges_by_unit"] = {
            unit: {"minimum": low, "maximum": high} for unit, (low, high) in ranges.items()
        }
    if field.flags_by_unit:
        data["flags_by_unit"] = {unit: table.name for unit, table in field.flags_by_unit.items()}
    return data


def _prefixes(units: Json) -> Json:
    """Return the prefixes, each with the unit of the document that its first unit corresponds to."""
    aliases = units.get("aliases", {})
    return {
        prefix: {
            **entry,
            **{k: v for k, v in aliases.get(entry["unit"], {}).items() if k == "like"},
        }
        for prefix, entry in units.get("known_prefixes", {}).items()
    }


def _on_stage(stage: Stage, scale: Factor | Conflict | str) -> Json:
    if isinstance(scale, str):
        return {"unknown": scale}
    if isinstance(scale, Conflict):
        return {"conflict": {source: _on_stage(stage, f) for source, f in scale.factors.items()}}
    return {**factor_json(scale), **_other_document(stage, scale)}


def _id(stage: Stage, found: StageId) -> Json:
    data: Json = {"id": found.id}
    if found.source:
        data["source"] = found.source
    if found.page is not None:
        data["page"] = found.page
    return {**data, **_other_document(stage, found)}


def _other_document(stage: Stage, fact: Factor | Limit | StageId | str) -> Json:
    """Return the overlay of a fact whose page is in another document than that of its stage."""
    if isinstance(fact, str) or fact.page is None or fact.overlay == stage.overlay:
        return {}
    return {"overlay": fact.overlay}


def _stage(stage: Stage) -> Json:
    return {
        "name": stage.name,
        "title": stage.title,
        "page": stage.page,
        **({"catalogue": list(stage.catalogue)} if stage.catalogue else {}),
        **({"axis": stage.axis} if stage.axis else {}),
        **({"rotary": True} if stage.rotary else {}),
        **({"ids": {f: _id(stage, found) for f, found in stage.ids.items()}} if stage.ids else {}),
        "controllers": {
            controller: {quantity: _on_stage(stage, scale) for quantity, scale in scales.items()}
            for controller, scales in stage.scales.items()
        },
        "limits": {
            name: {**limit_json(limit), **_other_document(stage, limit)}
            for name, limit in stage.limits.items()
        },
        **({"defaults": _defaults(stage)} if stage.defaults else {}),
        **_from(stage),
    }


def _defaults(stage: Stage) -> Json:
    note = {"note": stage.defaults_note} if stage.defaults_note else {}
    return {"source": stage.defaults_source, **note, **stage.defaults}

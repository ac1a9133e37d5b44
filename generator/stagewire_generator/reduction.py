"""A protocol reduced to the units that a project uses.

The reduced protocol has the messages of these units and whatever they refer to: enumerations, flag tables,
quantities, settings, stages, errata and examples. It is rendered like any other protocol, so the tables of a
parser hold nothing else.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeAlias, TypeVar

from stagewire_generator.model import Erratum, Json, Message, ParameterSet, Protocol, errata_of
from stagewire_generator.model_fields import Enumeration, Field, FlagTable
from stagewire_generator.model_scales import Controller, Stage

Table = TypeVar("Table", Enumeration, FlagTable)
_ScaleKey: TypeAlias = "tuple[str | None, str | None, str | None]"  # stage, controller, quantity


def units_of(protocol: Protocol) -> frozenset[str]:
    """Return the names that :func:`reduced` accepts: the units of a protocol, and other names of them."""
    aliases = protocol.units.get("aliases", {})
    return frozenset(
        (*protocol.units.get("units", ()), *(n for n, alias in aliases.items() if "like" in alias))
    )


def reduced(protocol: Protocol, names: Collection[str]) -> Protocol:
    """Return the protocol with these units only.

    :param names: names in :func:`units_of`. An alias also keeps the unit that it is like.
    """
    aliases = protocol.units.get("aliases", {})
    wanted = {aliases[name]["like"] if name in aliases else name for name in names}
    messages = _messages(protocol, wanted)
    kept = {message.name for message in messages}
    fields = list(_fields(messages))
    usual = list(
        _fields(m for m in protocol.messages if m.name in kept)
    )  # examples may name theirs
    sets = tuple(_sets(protocol.sets, kept))
    controllers = tuple(_controllers(protocol.controllers, {*wanted, *names}))
    stages = tuple(_stages(protocol.stages, {controller.name for controller in controllers}))
    quantities = tuple(q for q in protocol.quantities if any(q in f.quantities for f in fields))
    scales: set[_ScaleKey] = {(None, None, quantity.name) for quantity in quantities}
    scales |= {
        (stage.name, controller, name)
        for stage in stages
        for controller, table in stage.scales.items()
        for name in table
    }
    formats = {field.format.name for field in fields}
    idents = (protocol.units["units"][name].get("channel_idents") for name in wanted)
    named = {protocol.framing.get("axes"), *idents}
    examples = _examples(protocol, scales, kept, formats)
    cited = {slug for example in examples.values() for slug in errata_of(example)}
    return replace(
        protocol,
        summary=f"{protocol.summary} Generated for {', '.join(sorted(names))} only.",
        messages=messages,
        sets=sets,
        enumerations=tuple(
            enumeration
            for enumeration in protocol.enumerations
            if enumeration.name in named
            or any(enumeration in field.enumerations for field in fields)
            or any(enumeration == field.enum for field in usual)
        ),
        flags=tuple(
            table
            for table in protocol.flags
            if any(table in field.flag_tables for field in fields)
            or any(table == field.flags for field in usual)
        ),
        quantities=quantities,
        settings=_settings(protocol.settings, {*kept, *(s.name for s in sets)}),
        controllers=controllers,
        stages=stages,
        units=_units(protocol, wanted, names),
        errata=tuple(_about(protocol.errata, kept, cited)),
        rules=tuple(
            replace(rule, messages=tuple(name for name in rule.messages if name in kept))
            for rule in protocol.rules
            if not rule.messages or kept.intersection(rule.messages)
        ),
        examples={**protocol.examples, "examples": examples},
        captures={**protocol.captures, "captures": _captures(protocol, kept)},
    )


# Messages


def _messages(protocol: Protocol, units: Collection[str]) -> tuple[Message, ...]:
    """Return the messages of the units, and those that any unit may send."""
    entries = protocol.units["units"]
    listed = {name for entry in entries.values() for name in protocol.messages_of(entry)}
    kept = {name for unit in units for name in protocol.messages_of(entries[unit])}
    kept |= {
        message.name
        for message in protocol.messages
        if message.name not in listed and message.exchange.get("unsolicited")
    }
    kept |= {message.name for message in protocol.messages if message.twin_of in kept}
    known = {message.name for message in protocol.messages}
    return tuple(
        replace(
            message,
            exchange=_pruned(message.exchange, known, kept),
            layouts=tuple(
                replace(layout, fields=tuple(_for_units(f, units) for f in layout.fields))
                for layout in message.layouts
            ),
        )
        for message in protocol.messages
        if message.name in kept
    )


def _fields(messages: Iterable[Message]) -> Iterator[Field]:
    for message in messages:
        for layout in message.layouts:
            yield from layout.all_fields


def _pruned(exchange: Json, known: Collection[str], kept: Collection[str]) -> Json:
    """Return an exchange without the messages that are left out."""
    pruned: dict[str, Any] = {}
    for key, value in exchange.items():
        if isinstance(value, list) and value[0] in known:
            value = [name for name in value if name in kept]
            if not value:
                continue
        if isinstance(value, Mapping) and "read" in value and value["read"] not in kept:
            continue
        if key == "requires":
            value = {read: _needed(need, kept) for read, need in value.items() if read in kept}
            if not value:
                continue
        pruned[key] = value
    return pruned


def _needed(need: Json, kept: Collection[str]) -> Json:
    """Return what a motion needs, without fields that only units which are left out ignore."""
    has_ignoring_units = need.get("ignored", {}).get("with") in kept
    return {key: value for key, value in need.items() if key != "ignored" or has_ignoring_units}


def _for_units(field: Field, units: Collection[str]) -> Field:
    """Return a field with the tables of these units only.

    A table that all of them have becomes that of the field.
    """
    flags = {u: table for u, table in field.flags_by_unit.items() if u in units}
    enums = {u: enum for u, enum in field.enums_by_unit.items() if u in units}
    return replace(
        field,
        flags=_shared(flags, units) or field.flags,
        flags_by_unit=flags,
        ranges_by_unit={u: limits for u, limits in field.ranges_by_unit.items() if u in units},
        enum=_shared(enums, units) or field.enum,
        enums_by_unit=enums,
    )


def _shared(tables: Mapping[str, Table], units: Collection[str]) -> Table | None:
    """Return the table that all units have, if it is the same."""
    first, *others = (tables.get(unit) for unit in units)
    return first if all(other == first for other in others) else None


def _sets(sets: Iterable[ParameterSet], kept: Collection[str]) -> Iterator[ParameterSet]:
    """Yield the sets with the members that are kept."""
    for parameters in sets:
        members = {role: name for role, name in parameters.members.items() if name in kept}
        if members:
            yield replace(parameters, members=members)


def _settings(settings: Json, kept: Collection[str]) -> Json:
    """Return the settings that a message or set still reports, and those that none reports."""
    left = {
        name: {**entry, "told_by": {key: by for key, by in entry["told_by"].items() if key in kept}}
        for name, entry in settings.items()
    }
    told = {name for name, entry in settings.items() if entry["told_by"]}
    return {name: entry for name, entry in left.items() if entry["told_by"] or name not in told}


# Units and stages


def _units(protocol: Protocol, wanted: Collection[str], names: Collection[str]) -> Json:
    """Return the units and what they refer to, with the prefixes and aliases that belong to them."""
    units = protocol.units
    entries = {
        name: _with_its_lists(protocol, entry, wanted)
        for name, entry in units["units"].items()
        if name in wanted
    }
    families = {entry["family"] for entry in entries.values()}
    lists = {key for entry in entries.values() for key in protocol.lists_of(entry)}
    parts = {
        "units": entries,
        "families": {name: units["families"][name] for name in families},
        "lists": {key: units["lists"][key] for key in units.get("lists", ()) if key in lists},
        "aliases": {n: a for n, a in units.get("aliases", {}).items() if n in names},
        "known_prefixes": _prefixes(units.get("known_prefixes", {}), {*wanted, *names}),
    }
    return {**units, **{key: part for key, part in parts.items() if key in units}}


def _with_its_lists(protocol: Protocol, entry: Json, wanted: Collection[str]) -> Json:
    """Return a unit that names its lists itself if the unit that it is like is left out."""
    like = protocol.units["families"][entry["family"]].get("like")
    if like is None or like in wanted or "list" in entry:
        return entry
    first, *more = protocol.lists_of(entry)
    return {**entry, "list": first, **({"more_lists": more} if more else {})}


def _prefixes(prefixes: Json, names: Collection[str]) -> Json:
    """Return the prefixes that belong to at least one of the names, without the other units."""
    kept = {}
    for prefix, entry in prefixes.items():
        units = [u for u in (entry["unit"], *entry.get("shared_with", ())) if u in names]
        if units:
            rest = {key: value for key, value in entry.items() if key != "shared_with"}
            others = {"shared_with": units[1:]} if units[1:] else {}
            kept[prefix] = {**rest, "unit": units[0], **others}
    return kept


def _controllers(controllers: Iterable[Controller], names: Collection[str]) -> Iterator[Controller]:
    for controller in controllers:
        left = replace(
            controller,
            units=tuple(unit for unit in controller.units if unit in names),
            aliases={name: why for name, why in controller.aliases.items() if name in names},
        )
        if left.members:
            yield left


def _stages(stages: Iterable[Stage], controllers: Collection[str]) -> Iterator[Stage]:
    for stage in stages:
        scales = {name: table for name, table in stage.scales.items() if name in controllers}
        if scales:
            yield replace(stage, scales=scales)


# Errata, examples and captures


def _examples(
    protocol: Protocol,
    scales: Collection[_ScaleKey],
    kept: Collection[str],
    formats: Collection[str],
) -> Json:
    """Return the examples of the messages, scales and formats, and the statements about no message."""
    others = {
        erratum.id
        for erratum in protocol.errata
        if erratum.messages and not set(erratum.messages) & set(kept)
    }
    gone = {message.name for message in protocol.messages} - {*kept}
    found = {}
    for name, example in protocol.examples.get("examples", {}).items():
        named = {str(part).partition(".")[0] for part in example.get("claim", {}).values()}
        if named & gone:
            continue  # a statement about a message that is left out
        printed_is = example.get("printed_is", {})
        if {printed_is.get("decodes", {}).get("message"), printed_is.get("id_of")} & gone:
            continue  # its bytes are those of a message that is left out
        if example.get("format", "") not in ("", *formats):
            continue  # a number in a format that no field has
        if (
            example["message"] in kept
            if "message" in example
            else not others & {*errata_of(example)}
        ):
            left = _with_known_scales(example, scales)
            if left.get("stated") or "stated" not in example or "message" in example:
                found[name] = left
    return found


def _with_known_scales(example: Json, scales: Collection[_ScaleKey]) -> Json:
    """Return an example without the stated values whose scale is left out."""
    stated = example.get("stated")
    if stated is None:
        return example
    if isinstance(stated, dict):
        stated = {field: item for field, item in stated.items() if _scale_key(item) in scales}
    else:
        stated = [item for item in stated if _scale_key(item) in scales]
    rest = {key: value for key, value in example.items() if key != "stated"}
    return {**rest, **({"stated": stated} if stated else {})}


def _scale_key(item: Json) -> _ScaleKey:
    return item.get("stage"), item.get("controller"), item.get("quantity")


def _captures(protocol: Protocol, kept: Collection[str]) -> Json:
    """Return the captured frames of the messages."""
    entries = protocol.captures.get("captures", {})
    return {name: entry for name, entry in entries.items() if entry.get("message") in kept}


def _about(
    errata: Iterable[Erratum], kept: Collection[str], cited: Collection[str]
) -> Iterator[Erratum]:
    """Yield the errata about the messages or about none, and those that examples cite."""
    for erratum in errata:
        messages = tuple(name for name in erratum.messages if name in kept)
        if messages or not erratum.messages or erratum.id in cited:
            yield replace(erratum, messages=messages)

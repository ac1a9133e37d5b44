"""Resolve a whole protocol: framing, units, rules, and the model that contains them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import rules_of
from stagewire_generator.model import Json, Overlay, ParameterSet, Protocol, Rule, Sentence
from stagewire_generator.naming import can_name_file, can_name_package
from stagewire_generator.resolver.evidence import resolve_evidence
from stagewire_generator.resolver.messages import (
    define_commands,
    define_errata,
    define_messages,
    define_parameter_sets,
)
from stagewire_generator.resolver.scales import define_quantities, resolve_settings, resolve_stages
from stagewire_generator.resolver.tables import (
    Tables,
    define_blocks,
    define_chapters,
    define_enumerations,
    define_flags,
    firmware,
)
from stagewire_generator.strict_yaml import Document


def resolve_framing(tables: Tables) -> Json:
    """Return the framing with the ``size`` in bytes added to every format, and defaults filled in.

    For an unknown format, add a diagnostic and leave the size out.
    """
    framing: Json = dict(tables.head.data["framing"])
    for part in rules_of(framing["kind"]).formats:
        if part in framing:
            place = tables.head.place("framing", part)
            format = tables.format(framing[part]["format"], place)
            size = {} if format is None else {"size": format.size}
            framing[part] = {**framing[part], **size}
    if framing.get("check", {}).get("method") == "sum":
        framing["check"] = {"complement": "none", **framing["check"]}
    return framing


def define_rules(tables: Tables) -> None:
    """Fill the table of rules, and look up the messages and errata that they name."""
    for document, id, entry, place in tables.entries("rules", "rules", tables.rules):
        at = ("rules", id)
        for part, table, kind in (
            ("messages", tables.messages, "message"),
            ("errata", tables.errata, "erratum"),
        ):
            for index, name in enumerate(entry.get(part, ())):
                if name not in table:  # a position costs more than a look-up
                    tables.look_up(table, name, kind, document.place(*at, part, index))
        tables.rules[id] = Rule(
            id=id,
            page=entry["page"],
            also=tuple(entry.get("also", ())),
            strength=entry["strength"],
            subject=entry["subject"],
            states=entry["states"],
            means=entry.get("means", ""),
            messages=tuple(entry.get("messages", ())),
            errata=tuple(entry.get("errata", ())),
            waiver=entry.get("waiver", ""),
            sentences=tuple(Sentence(**each) for each in entry.get("sentences", ())),
            place=place,
            overlay=document.overlay,
        )


_OF_ALIASES = {"like": "like", "note": "title", "overlay": "overlay"}
"""Key of a prefix -> key of the alias that it defines."""


def resolve_units(files: Mapping[str, list[Document]], sets: Mapping[str, ParameterSet]) -> Json:
    """Return the data about units, with the ``list`` of each unit, and the aliases that prefixes define.

    A list names its units, and the lists after the first are the ``more_lists`` of a unit. A status ``none``
    is left out. In a list and in a family, the name of a parameter set means all its messages. A prefix may
    define an alias by ``like``. A unit replaces an alias of the same name: once an overlay describes it, it
    is no longer newer than the document.
    """
    units: Json = files["units"][0].data if files.get("units") else {}
    for section in ("lists", "families"):
        if section in units:
            named = {key: _with_members(entry, sets) for key, entry in units[section].items()}
            units = {**units, section: named}
    lists: dict[str, list[str]] = {}
    for key, entry in units.get("lists", {}).items():
        for name in entry["units"]:
            lists.setdefault(name, []).append(key)
    if units:
        entries = {n: _unit(e, lists.get(n, ())) for n, e in units["units"].items()}
        units = {**units, "units": entries}
    if not units.keys() & {"aliases", "known_prefixes"}:
        return units
    described = {*units["units"], *units.get("unsupported", ())}
    aliases = {n: entry for n, entry in units.get("aliases", {}).items() if n not in described}
    for entry in units.get("known_prefixes", {}).values():
        name = entry["unit"]
        if "like" in entry and name not in described and name not in aliases:
            aliases[name] = {_OF_ALIASES[key]: entry[key] for key in _OF_ALIASES if key in entry}
    prefixes = {
        prefix: {key: value for key, value in entry.items() if key != "like"}
        for prefix, entry in units.get("known_prefixes", {}).items()
    }
    return {**units, "aliases": aliases, "known_prefixes": prefixes}


def _unit(entry: Json, lists: Sequence[str]) -> Json:
    """Return the entry of a unit with the names of its lists."""
    entry = {key: value for key, value in entry.items() if (key, value) != ("status", "none")}
    if lists:
        entry["list"] = lists[0]
    if lists[1:]:
        entry["more_lists"] = list(lists[1:])
    return entry


def _with_members(entry: Json, sets: Mapping[str, ParameterSet]) -> Json:
    """Return a list or family with the messages of each set in place of its name."""
    parts = {part: entry[part] for part in ("messages", "completes") if part in entry}
    return {
        **entry,
        **{
            part: [
                message
                for name in names
                for message in (sets[name].members.values() if name in sets else (name,))
            ]
            for part, names in parts.items()
        },
    }


def resolve(files: Mapping[str, list[Document]], diagnostics: Diagnostics) -> Protocol:
    """Return the model of one protocol, made from its files by kind."""
    tables = Tables(files, diagnostics)
    _check_names(tables)
    define_errata(tables)
    define_quantities(tables)
    define_chapters(tables)
    define_enumerations(tables)
    define_flags(tables)
    define_blocks(tables)
    for document in files.get("messages", []):
        define_parameter_sets(tables, document)
        define_messages(tables, document)
        define_commands(tables, document)
    define_rules(tables)
    controllers, stages = resolve_stages(tables)
    head = tables.head.data
    framing = resolve_framing(tables)
    messages = sorted(
        tables.messages.values(),
        key=lambda m: (m.id is None, m.id or 0, m.sub_message or 0, m.name),
    )
    return Protocol(
        name=head["protocol"],
        title=head["title"],
        summary=head["summary"],
        document=head["document"],
        firmware=firmware(head),
        package=head["python"]["package"],
        python_title=head["python"].get("title", head["title"]),
        version=head["python"].get("version", "0.1.0"),
        name_prefix=head.get("name_prefix", ""),
        formats=tables.formats,
        framing=framing,
        id_size=rules_of(framing["kind"]).id_size or framing.get("id", {}).get("size", 1),
        contexts=head.get("contexts", {}),
        chapters=tuple(sorted(tables.chapters.values(), key=lambda c: (c.order, c.name))),
        messages=tuple(messages),
        sets=tuple(tables.sets[name] for name in sorted(tables.sets)),
        enumerations=tuple(tables.enumerations.values()),
        flags=tuple(tables.flags.values()),
        quantities=tuple(tables.quantities.values()),
        settings=resolve_settings(tables),
        controllers=controllers,
        stages=stages,
        units=resolve_units(files, tables.sets),
        errata=tuple(tables.errata[id] for id in sorted(tables.errata)),
        rules=tuple(tables.rules[id] for id in sorted(tables.rules)),
        examples=_data(files, "examples"),
        captures=_data(files, "captures"),
        evidence=resolve_evidence(tables, stages),
        overlays=tuple(_overlay(document) for document in files.get("overlay", ())),
    )


def _overlay(document: Document) -> Overlay:
    data, place = document.data, document.place("overlay")
    default = data.get("default", False)
    return Overlay(
        data["overlay"], data["title"], data["summary"], data["document"], place, default
    )


def _check_names(tables: Tables) -> None:
    """Check that the protocol is a possible file name and the package a possible package name."""
    head = tables.head
    protocol, package = head.data["protocol"], head.data["python"]["package"]
    if not can_name_file(protocol):
        place = head.place("protocol")
        tables.diagnostics.add(place, "SW023", f"{protocol} is a reserved file name")
    else:
        _check_owner(tables, protocol)
    if not can_name_package(package):
        place = head.place("python", "package")
        tables.diagnostics.add(place, "SW023", f"{package} is a reserved package name")


def _check_owner(tables: Tables, protocol: str) -> None:
    """Check that the worked examples and captures name this protocol."""
    for kind in ("examples", "captures"):
        for document in tables.files.get(kind, ()):
            if (named := document.data["protocol"]) != protocol:
                what = f"the {kind} of {protocol} name the protocol {named}"
                hint = f"write {protocol}"
                tables.diagnostics.add(document.place("protocol"), "SW021", what, hint)


def _data(files: Mapping[str, list[Document]], kind: str) -> Json:
    """Return the contents of the only file of a kind, or nothing if it is missing."""
    found: Json = files[kind][0].data if files.get(kind) else {}
    return found

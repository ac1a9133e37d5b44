"""The whole protocol: what is defined first, and the model that comes of it."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Json, Overlay, Protocol
from stagewire_generator.naming import can_name_file, can_name_package
from stagewire_generator.resolver.commands import define_commands
from stagewire_generator.resolver.definitions import (
    define_blocks,
    define_chapters,
    define_enumerations,
    define_flags,
    firmware,
)
from stagewire_generator.resolver.errata import define_errata
from stagewire_generator.resolver.framing import resolve_framing
from stagewire_generator.resolver.messages import define_messages
from stagewire_generator.resolver.parameter_sets import define_parameter_sets
from stagewire_generator.resolver.rules import define_rules
from stagewire_generator.resolver.scales import define_quantities, resolve_settings, resolve_stages
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.resolver.units import resolve_units
from stagewire_generator.strict_yaml import Document

__all__ = ["resolve"]


def resolve(files: Mapping[str, list[Document]], diagnostics: Diagnostics) -> Protocol:
    """Make the model of one protocol from its files, sorted by kind."""
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
    messages = sorted(tables.messages.values(), key=lambda m: (m.id is None, m.id or 0, m.name))
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
        framing=resolve_framing(tables),
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
        units=resolve_units(files),
        errata=tuple(tables.errata[id] for id in sorted(tables.errata)),
        rules=tuple(tables.rules[id] for id in sorted(tables.rules)),
        examples=_data(files, "examples"),
        captures=_data(files, "captures"),
        overlays=tuple(_overlay(document) for document in files.get("overlay", ())),
    )


def _overlay(document: Document) -> Overlay:
    data, place = document.data, document.place("overlay")
    return Overlay(data["overlay"], data["title"], data["summary"], data["document"], place)


def _check_names(tables: Tables) -> None:
    """Check that protocol and package can be the names of a file and of a Python package."""
    head = tables.head
    protocol, package = head.data["protocol"], head.data["python"]["package"]
    if not can_name_file(protocol):
        place = head.place("protocol")
        tables.diagnostics.add(place, "SW023", f"{protocol} is reserved as the name of a file")
    else:
        _check_owner(tables, protocol)
    if not can_name_package(package):
        place = head.place("python", "package")
        tables.diagnostics.add(place, "SW023", f"{package} is reserved as the name of a package")


def _check_owner(tables: Tables, protocol: str) -> None:
    """Check that the worked examples and captures that were found name this protocol as theirs."""
    for kind in ("examples", "captures"):
        for document in tables.files.get(kind, ()):
            if (named := document.data["protocol"]) != protocol:
                what, hint = f"{kind} of {named}, beside {protocol}", f"write {protocol}"
                tables.diagnostics.add(document.place("protocol"), "SW021", what, hint)


def _data(files: Mapping[str, list[Document]], kind: str) -> Json:
    """Return what the only file of a kind holds; nothing where it is missing."""
    found: Json = files[kind][0].data if files.get(kind) else {}
    return found

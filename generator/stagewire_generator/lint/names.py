"""Check names: undefined references, and names that clash in generated code."""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator

from stagewire_generator.diagnostics import Diagnostics, Place, meant
from stagewire_generator.lint.c_names import C_KEYWORDS, C_NAMES, CPP_KEYWORDS, check_c_names
from stagewire_generator.model import STATES, Json, Message, Protocol
from stagewire_generator.model_scales import Stage
from stagewire_generator.naming import camel, message_classes
from stagewire_generator.strict_yaml import Document

# Attributes that generated classes define themselves.
_MEMBERS = frozenset({
    "layout", "unpack", "pack", "values", "replace", "keep", "shared", "mro", "data", "param1",
    "param2", "reply", "marks", "shape"
})  # fmt: skip
# Names that the modules of a generated package import, and names reserved in Python.
_KEPT = frozenset({"False", "None", "True"})
_IN_CHAPTERS = _KEPT | frozenset({
    "Command", "Direction", "FramedMessage", "Layout", "PacketMessage", "Reply", "Self",
    "SetupCommand", "Struct", "UndecidedMessage", "UndocumentedMessage"
})  # fmt: skip
_IN_MESSAGES = _IN_CHAPTERS | frozenset({
    "CommandProtocol", "Crc", "FramedProtocol", "MESSAGES", "Message", "PROTOCOL", "PacketProtocol",
    "Shape", "Sum", "Xor"
})  # fmt: skip
_IN_FLAGS = _IN_CHAPTERS | frozenset({"Bit", "Flags"})
_IN_ENUMERATIONS = _KEPT | frozenset({"Enumeration"})
_IN_STAGES = _KEPT | frozenset({
    "EndlessTravel", "Limit", "Scale", "ScaleConflict", "Stage", "UnknownLimit", "UnknownScale"
})  # fmt: skip
_IN_UNITS = _KEPT | frozenset({
    "AxesDevice", "Axis", "Bay", "Channel", "ChannelsBay", "ChannelsDevice", "FACTS", "ModuleDevice",
    "PROTOCOL", "PositionsDevice", "RackDevice", "SingleChannelDevice", "SingleChannelModule", "UNITS"
})  # fmt: skip
_PARTS_OF_UNITS = ("Axis", "Bay", "Channel")  # suffixes of the classes for parts of units
# Names that the methods of a generated message call or assign.
_IN_METHODS = frozenset({
    "self", "cls", "raw", "draft", "bytes", "classmethod", "property", "check_addresses",
    "check_bytes", "check_integer", "check_text"
})  # fmt: skip
_RESERVED = C_KEYWORDS | CPP_KEYWORDS | C_NAMES | frozenset(keyword.kwlist) | _IN_METHODS
_TO_HOST = frozenset({"answered_by", "completes_with", "stops_with", "announces"})


def check_names(protocol: Protocol, units: Document | None, diagnostics: Diagnostics) -> None:
    """Check every name of the protocol.

    :param units: the file of the units, for the positions of errors.
    """
    before = diagnostics.reported
    _fields(protocol, diagnostics)
    _classes(protocol, diagnostics)
    _exchanges(protocol, diagnostics)
    _apart([(c.name, c.place) for c in protocol.controllers], diagnostics)
    _members(protocol, diagnostics)
    if units is not None:
        _units(protocol, units, diagnostics)
        _units_of_fields(protocol, diagnostics)
    if diagnostics.reported == before:  # otherwise C would repeat the errors for the same names
        check_c_names(protocol, diagnostics)


def _fields(protocol: Protocol, diagnostics: Diagnostics) -> None:
    for message in protocol.messages:
        for layout in message.layouts:
            seen: dict[str, str] = {}
            with_flags = {field.name for field in layout.all_fields if field.flags}
            for field in layout.all_fields:
                unnamed = field.role == "constant" and field.name in ("param1", "param2")
                if (field.name in _RESERVED or field.name in _MEMBERS) and not unnamed:
                    diagnostics.add(
                        field.place,
                        "SW023",
                        f"{message.name}: the field name {field.name} is reserved",
                    )
                folded = field.name.replace("_", "").lower()
                if folded in seen:
                    diagnostics.add(
                        field.place,
                        "SW022",
                        f"{message.name}: {field.name} and {seen[folded]} differ only in case or underscores",
                    )
                seen[folded] = field.name
                flags = field.name.removesuffix("_flags")
                if flags != field.name and flags in with_flags:
                    what = f"{message.name}: {field.name} is the name for the bits of {flags}"
                    diagnostics.add(field.place, "SW022", what)
    for enumeration in protocol.enumerations:
        names = [value.name for value in enumeration.values]
        _distinct(names, f"the values of {enumeration.name}", enumeration.place, diagnostics)
        for name in names:
            if name in _RESERVED or name == "mro":
                diagnostics.add(
                    enumeration.place,
                    "SW023",
                    f"{enumeration.name}: the value name {name} is reserved",
                )
    for table in protocol.flags:
        names = [bit.name for bit in table.bits]
        _distinct(names, f"the bits of {table.name}", table.place, diagnostics)
        for name in names:
            if (
                name in _RESERVED
                or hasattr(int, name)
                or name in ("bits", "of", "names", "unnamed")
            ):
                what = f"{table.name}: the bit name {name} is reserved"
                diagnostics.add(table.place, "SW023", what)


def _distinct(names: Iterable[str], what: str, place: Place, diagnostics: Diagnostics) -> None:
    seen: dict[str, str] = {}
    for name in names:
        folded = name.replace("_", "").lower()
        if folded in seen:
            diagnostics.add(
                place,
                "SW022",
                f"{what}: {name} and {seen[folded]} differ only in case or underscores",
            )
        seen[folded] = name


def _classes(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that names of classes differ even if a file system or a language ignores case."""
    seen: dict[str, str] = {}
    for name, place in (
        *((m.name, m.place) for m in protocol.messages),
        *((e.name, e.place) for e in protocol.enumerations),
        *((t.name, t.place) for t in protocol.flags),
    ):
        folded = name.replace("_", "").lower()
        if folded in seen and seen[folded] != name:
            diagnostics.add(
                place, "SW022", f"{name} and {seen[folded]} differ only in case or underscores"
            )
        seen[folded] = name
    classes: dict[str, str] = {}
    for table in protocol.flags:
        name = camel(table.name)
        classes[name] = table.name  # modules import it together with the messages
        if name in _IN_FLAGS:
            what = f"{table.name}: the class name {name} is reserved"
            diagnostics.add(table.place, "SW023", what)
    for enumeration in protocol.enumerations:
        name = camel(enumeration.name)
        if name in _IN_ENUMERATIONS:
            diagnostics.add(
                enumeration.place, "SW023", f"{enumeration.name}: the class name {name} is reserved"
            )
    for message in protocol.messages:
        for name in _class_names(message):
            if name in _IN_MESSAGES:
                diagnostics.add(
                    message.place, "SW023", f"{message.name}: the class name {name} is reserved"
                )
            if name in classes:
                what = f"{message.name} and {classes[name]} would both become the class {name}"
                if classes[name] == message.name:
                    what = f"{message.name}: two of its forms would become the class {name}"
                hint = "rename one of them, or give a message another `spelling`"
                diagnostics.add(message.place, "SW022", what, hint)
            classes[name] = message.name
    for stage in protocol.stages:
        if stage.name in _IN_STAGES:
            diagnostics.add(stage.place, "SW023", f"the stage name {stage.name} is reserved")
    _apart([(stage.name, stage.place) for stage in protocol.stages], diagnostics)
    stages = {stage.name.upper(): stage.name for stage in protocol.stages}
    for stage in protocol.stages:
        for name in stage.catalogue:
            other = stages.get(name.upper(), stage.name)
            if other != stage.name:
                what = f"{stage.name}: {name} in the catalogue is the name of another stage"
                diagnostics.add(stage.place, "SW022", what)
    _catalogue(protocol.stages, diagnostics)


def _catalogue(stages: Iterable[Stage], diagnostics: Diagnostics) -> None:
    """Check that the stages with a name in the catalogue are different axes, or on different controllers."""
    seen: dict[tuple[str, str], list[Stage]] = {}  # name and controller -> stages
    for stage in stages:
        for name in stage.catalogue:
            others = [
                other
                for controller in stage.scales
                for other in seen.get((name.upper(), controller), ())
                if not stage.axis or stage.axis.lower() in (other.axis.lower(), "")
            ]
            if others:
                what = f"{stage.name}: {name} is also the catalogue name of {others[0].name}"
                hint = (
                    "correct one of them; if they are axes of one device, give each its own `axis`"
                )
                diagnostics.add(stage.place, "SW022", what, hint)
                break
        for name in stage.catalogue:
            for controller in stage.scales:
                seen.setdefault((name.upper(), controller), []).append(stage)


def _apart(named: Iterable[tuple[str, Place]], diagnostics: Diagnostics) -> None:
    """Check that names in mixed case differ even if a language or a reader ignores case."""
    seen: dict[str, str] = {}
    for name, place in named:
        folded = name.lower()
        if folded in seen:
            diagnostics.add(
                place, "SW022", f"{name} and {seen[folded]} differ only in case or underscores"
            )
        seen[folded] = name


def _class_names(message: Message) -> Iterator[str]:
    """Yield the names of all classes that a message becomes."""
    if message.layouts:
        yield from message_classes(message).values()
    else:
        yield message.class_name
    if any(layout.when for layout in message.layouts):
        yield message.class_name + "Undecided"


def _exchanges(protocol: Protocol, diagnostics: Diagnostics) -> None:
    names = {message.name: message for message in protocol.messages}
    for message in protocol.messages:
        for key, value in message.exchange.items():
            if not isinstance(value, list):
                continue
            for name in value:
                other = names.get(name)
                if other is None:
                    what = f"{message.name}: {key}: unknown message {name}"
                    diagnostics.add(message.place, "SW021", what, meant(name, names))
                elif key in _TO_HOST and other.direction == "to_controller":
                    diagnostics.add(
                        message.place,
                        "SW035",
                        f"{message.name}: {key}: only the host sends {name}",
                    )


def _members(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that newer units are listed under `aliases`, and that a unit has one scale per stage."""
    aliases = protocol.units.get("aliases", {})
    known = {*protocol.units.get("units", ()), *aliases}
    groups = {controller.name: controller for controller in protocol.controllers}
    for controller in protocol.controllers:
        for name in controller.units:
            if name in aliases:
                what = (
                    f"controllers.{controller.name}: {name} is an alias, not a unit of the document"
                )
                hint = "list it under `aliases` with the source of its scales"
                diagnostics.add(controller.place, "SW021", what, hint)
        for name in controller.aliases:
            if name not in known:
                what = f"controllers.{controller.name}: unknown alias {name}"
                diagnostics.add(controller.place, "SW021", what, meant(name, known))
    for stage in protocol.stages:
        seen: dict[str, str] = {}
        for group in filter(groups.__contains__, stage.scales):
            for name in dict.fromkeys(groups[group].members):
                if name in seen:
                    what = f"{stage.name}: {name} has scales in {seen[name]} and in {group}"
                    diagnostics.add(stage.place, "SW037", what, "remove it from one of them")
                seen[name] = group


def _units_of_fields(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check the units for which a field has names of their own. Messages may share a field."""
    known = {
        name
        for section in ("units", "aliases", "unsupported")
        for name in protocol.units.get(section, ())
    }
    fields = {
        field.place: field
        for message in protocol.messages
        for layout in message.layouts
        for field in layout.all_fields
    }
    for place, field in fields.items():
        for unit in dict.fromkeys(
            [*field.flags_by_unit, *field.enums_by_unit, *field.ranges_by_unit]
        ):
            if unit not in known:
                what = f"{field.name}: unknown unit {unit}"
                diagnostics.add(place, "SW021", what, meant(unit, known))


def _unknown_forms(protocol: Protocol, entry: Json) -> Iterator[tuple[str, str]]:
    """Yield the messages of a unit that lack the form in which it sends them, with that form."""
    for message in protocol.messages:
        if message.name in entry.get("sends", {}):
            form = entry["sends"][message.name]["form"]
            if form.replace("_", ":", 1) not in {layout.form for layout in message.layouts}:
                yield message.name, form


def _context_values(unit: Json) -> Iterator[tuple[str, str]]:
    """Yield the contexts of a unit, each with each of its values."""
    for name, given in unit.get("contexts", {}).items():
        for value in [{"value": given}] if isinstance(given, str) else given:
            yield name, value["value"]


def _idents(
    protocol: Protocol, unit: str, entry: Json, document: Document, diagnostics: Diagnostics
) -> None:
    """Check that the enumeration of the channels of a unit exists and has a value for each channel."""
    name, tables = entry["channel_idents"], {table.name: table for table in protocol.enumerations}
    place = document.place("units", unit, "channel_idents")
    if name not in tables:
        what = f"units.{unit}: unknown enumeration {name}"
        diagnostics.add(place, "SW021", what, meant(name, tables))
    elif len(tables[name].values) < entry["channels"]:
        values = len(tables[name].values)
        what = f"units.{unit}: {entry['channels']} channels, but {name} has {values} values"
        diagnostics.add(place, "SW021", what)


def _units(protocol: Protocol, document: Document, diagnostics: Diagnostics) -> None:
    messages = {message.name for message in protocol.messages}
    stages = {stage.name for stage in protocol.stages}
    data = protocol.units
    families = data["families"]
    listed = messages | {group.name for group in protocol.sets}

    def known(names: Iterable[str], table: Iterable[str], kind: str, *path: str | int) -> None:
        for index, name in enumerate(names):
            if name not in table:
                place = document.place(*path, index)
                what = f"{path[0]}.{path[1]}: unknown {kind} {name}"
                diagnostics.add(place, "SW021", what, meant(name, table))

    for name in data["units"]:
        if name in _IN_UNITS:
            place = document.place("units", name)
            diagnostics.add(place, "SW023", f"the unit name {name} is reserved")
        for part in _PARTS_OF_UNITS:
            if name.removesuffix(part) in data["units"] and name.endswith(part):
                what = f"the unit {name} has the same name as a class for {name.removesuffix(part)}"
                diagnostics.add(document.place("units", name), "SW022", what)
    names = data.get("lists", {})
    _apart([(name, document.place("lists", name)) for name in names], diagnostics)
    for key, entry in document.data.get("lists", {}).items():
        for part in ("messages", "completes", "misprinted", "cannot_stop"):
            known(entry.get(part, ()), listed, "message", "lists", key, part)
        known(entry["units"], data["units"], "unit", "lists", key, "units")
    for key, entry in document.data["families"].items():
        known(entry.get("messages", ()), listed, "message", "families", key, "messages")
        if "like" in entry:
            units = [name for name, unit in data["units"].items() if "list" in unit]
            known([entry["like"]], units, "unit with a list:", "families", key, "like")
    for key, entry in data["units"].items():
        known(entry["stages"], stages, "stage", "units", key, "stages")
        for name, value in _context_values(entry):
            if value not in protocol.contexts.get(name, {}).get("values", ()):
                place = document.place("units", key, "contexts", name)
                what = f"units.{key}: unknown context {name}: {value}"
                diagnostics.add(place, "SW021", what)
        known([entry["family"]], families, "family", "units", key, "family")
        if "channel_idents" in entry:
            _idents(protocol, key, entry, document, diagnostics)
        if "built_in" in entry:
            known([entry["built_in"]], stages, "stage", "units", key, "built_in")
        keeper = entry.get("keep_alive", "none")
        if keeper != "none":
            known([keeper], messages, "message", "units", key, "keep_alive")
        known(entry.get("sends", ()), messages, "message", "units", key, "sends")
        for state in STATES:
            for index, order in enumerate(entry.get(state, {}).get("messages", ())):
                at = ("units", key, state, "messages", index, "message")
                known([order["message"]], messages, "message", *at)
        for name, form in _unknown_forms(protocol, entry):
            place = document.place("units", key, "sends", name, "form")
            diagnostics.add(place, "SW021", f"units.{key}: unknown form {form} of {name}")
    written = document.data  # here a prefix may define an alias
    for section in ("units", "aliases"):
        for key, entry in data.get(section, {}).items():
            for model in entry.get("reported_as", ()):
                if model in data["units"] or model in data.get("aliases", {}):
                    whose = "the unit itself" if model == key else "another unit"
                    what = f"{section}.{key}: reported_as lists {model}, the name of {whose}"
                    hint = f"remove it: a controller that reports {model} is identified as {model}"
                    place = document.place(section, key, "reported_as", model)
                    diagnostics.add(place, "SW022", what, hint)
    places = [(name, document.place("units", name)) for name in data["units"]]
    places += [
        (name, document.place("aliases", name))
        for name in written.get("aliases", {})
        if name not in data["units"]
    ]
    places += [
        (name, document.place("unsupported", name))
        for name in data.get("unsupported", {})
        if name not in {*data["units"], *data.get("aliases", {})}
    ]
    _apart(places, diagnostics)
    for section in ("aliases", "known_prefixes"):
        for key, entry in written.get(section, {}).items():
            if "like" in entry:
                known([entry["like"]], data["units"], "unit", section, key, "like")
    described = {*data["units"], *written.get("aliases", {}), *data.get("unsupported", {})}
    for prefix, entry in written.get("known_prefixes", {}).items():
        own = ("known_prefixes", prefix, "unit")
        others = enumerate(entry.get("shared_with", ()))
        names_at: dict[tuple[str | int, ...], str] = {}
        if "like" not in entry:
            names_at[own] = entry["unit"]
        names_at |= {(*own[:2], "shared_with", index): name for index, name in others}
        for path, name in names_at.items():
            if name not in described:
                what = f"known_prefixes.{prefix}: unknown unit {name}"
                hint = f"correct it, or describe {name} under `units`, `aliases` or `unsupported`"
                diagnostics.add(document.place(*path), "SW021", what, hint)

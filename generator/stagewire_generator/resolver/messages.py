"""Resolve messages, commands and errata.

A parameter set expands into the messages SET, REQ and GET, which share their content. A command is a byte, a
request and a reply, whose sizes are compared with the data. An erratum is attached to the messages and fields
that it names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Erratum, Json, Layout, Message, ParameterSet
from stagewire_generator.model_fields import Field
from stagewire_generator.resolver.layouts import (
    header_layout,
    resolve_fields,
    resolve_layouts,
    with_sub_message,
)
from stagewire_generator.resolver.tables import (
    Tables,
    firmware,
    joined,
    spelled_words,
    spelling_of,
    split_group,
)
from stagewire_generator.strict_yaml import Document, KeyPath


def define_errata(tables: Tables) -> None:
    """Fill the table of errata, and the table of the messages and fields that they name."""
    for document, id, entry, place in tables.entries("errata", "errata", tables.errata):
        erratum = _erratum(id, entry, place, document.overlay)
        tables.errata[id] = erratum
        for name in (*erratum.messages, *erratum.fields):
            tables.errata_of.setdefault(name, set()).add(id)
            tables.errata_owners.add(name.partition(".")[0])


def with_errata(tables: Tables, message: Message) -> Message:
    """Return the message with the errata that name it, its set or its fields.

    An erratum does not apply to a message of an overlay that replaces the one it is about. It applies if it
    is from the same overlay as the message, or from one that builds on it.
    """
    named = message.twin_of or message.name
    owners = {named} | ({message.set[0]} if message.set else set())
    if owners.isdisjoint(tables.errata_owners):
        return message

    def of(*names: str) -> tuple[str, ...]:
        found = {id for name in names for id in tables.errata_of.get(name, ())}
        return tuple(sorted(id for id in found if message.overlay in covered(tables.errata[id])))

    def covered(erratum: Erratum) -> set[str]:
        return {"", erratum.overlay, *tables.under.get(erratum.overlay, ())}

    def marked(field: Field) -> Field:
        found = of(*(f"{owner}.{field.name}" for owner in owners))
        return replace(field, errata=found) if found else field

    layouts = tuple(_with_fields(layout, marked) for layout in message.layouts)
    errata = of(named)
    if not errata and layouts == message.layouts:
        return message
    return replace(message, layouts=layouts, errata=errata)


def _with_fields(layout: Layout, marked: Callable[[Field], Field]) -> Layout:
    param1 = layout.param1 and marked(layout.param1)
    param2 = layout.param2 and marked(layout.param2)
    fields = tuple(marked(field) for field in layout.fields)
    if (param1, param2, fields) == (layout.param1, layout.param2, layout.fields):
        return layout
    return replace(layout, param1=param1, param2=param2, fields=fields)


def _erratum(id: str, entry: Json, place: Place, overlay: str) -> Erratum:
    places = {name: (sides[0], sides[1]) for name, sides in entry.get("places", {}).items()}
    printed, encoded = next(iter(places.values()), ("", ""))
    return Erratum(
        id=id,
        pages=tuple(entry["pages"]),
        subject=entry["subject"],
        messages=tuple(entry.get("messages", ())),
        fields=tuple(entry.get("fields", ())),
        printed=entry.get("printed", printed or "nothing"),
        encoded=entry.get("encoded", encoded or "nothing"),
        evidence=entry["evidence"],
        kind=entry["class"],
        origin=entry["origin"],
        places=places,
        not_compared=tuple(entry.get("not_compared", ())),
        place=place,
        overlay=overlay,
    )


def define_messages(tables: Tables, document: Document) -> None:
    """Add the messages of a file."""
    for name, entry in document.data.get("messages", {}).items():
        _define_message(tables, document, name, entry)


def add_message(tables: Tables, message: Message) -> None:
    """Add a message with its errata; report a duplicate name."""
    for name in (message.name, *message.aliases):
        taken = name in tables.messages or name in tables.aliases
        if taken or (name == message.name and name in message.aliases):
            tables.diagnostics.add(message.place, "SW020", f"{name} is defined twice")
            return
    tables.messages[message.name] = with_errata(tables, message)
    tables.aliases.update(message.aliases)


def _define_message(tables: Tables, document: Document, name: str, entry: Json) -> None:
    path = ("messages", name)
    place = document.place(*path)
    group, rest = split_group(tables, name)
    layouts: tuple[Layout, ...] = ()
    if entry.get("layout") != "undocumented":
        layouts = resolve_layouts(tables, document, path, entry, entry["page"], name)
    sub_message = entry.get("sub_message")
    message = Message(
        name=name,
        id=None if entry["id"] == "unknown" else entry["id"],
        chapter=document.data["chapter"],
        words=spelled_words(tables, group, spelling_of(entry, rest), name, place),
        pages=tuple(sorted({entry["page"], *entry.get("more_pages", ())})),
        direction=entry["direction"],
        effect=entry.get("effect", ""),
        hazard=entry.get("hazard", ""),
        summary=entry["summary"],
        note=entry.get("note", ""),
        set=None,
        title=entry.get("title", ""),
        exchange=dict(entry.get("exchange", {})),
        layouts=tuple(with_sub_message(layout, sub_message) for layout in layouts),
        errata=(),
        place=place,
        group=group.lower(),
        addressee=entry.get("addressee", ""),
        call=entry.get("call", {}),
        aliases={
            other: spelled_words(tables, split_group(tables, other)[0], spelling, other, place)
            for other, spelling in entry.get("also_named", {}).items()
        },
        later_pages=entry.get("later_pages", {}),
        overlay=document.overlay,
        sub_message=sub_message,
        not_sent=entry.get("not_sent", ""),
    )
    add_message(tables, message)
    if "also_id" in entry:
        add_message(tables, _twin(message, entry["also_id"]))


def _twin(message: Message, id: int) -> Message:
    """Return the message with another id, which its sources also give; its name ends with the id."""
    digits = f"{id:04X}"
    return replace(
        message,
        name=f"{message.name}_{digits}",
        id=id,
        words=(*message.words, digits.lower()),
        note=f"{message.name} with the other id that the sources give.",
        set=None,
        title="",
        aliases={},
        twin_of=message.name,
    )


_ROLES = ("set", "req", "get")
_CODES = {"effect": "SW070", "hazard": "SW072"}  # of a set without a SET
_EFFECTS = {"set": "settings", "req": "none", "get": ""}  # defaults for a parameter set


def define_parameter_sets(tables: Tables, document: Document) -> None:
    """Fill the table of parameter sets from a file, and add the messages of each."""
    for name, entry in document.data.get("parameter_sets", {}).items():
        place = document.place("parameter_sets", name)
        if name in tables.sets:
            tables.diagnostics.add(place, "SW020", f"{name} is defined twice")
            continue
        group, rest = split_group(tables, name)
        words = spelled_words(tables, group, spelling_of(entry, rest), name, place)
        members = {role: _member(group, role, rest) for role in _ROLES if role in entry["ids"]}
        found = ParameterSet(name, words, members, place)
        tables.sets[name] = found
        for key, article in (("effect", "an"), ("hazard", "a")):
            if key in entry and "set" not in members:
                what = f"{name} declares {article} {key}, but has no SET that it could apply to"
                tables.diagnostics.add(place, _CODES[key], what, f"remove the {key}")
        shared = cache(partial(_shared_layouts, tables, document, entry, name))
        for role in members:
            _define_member(tables, document, entry, found, group, role, shared)


def _shared_layouts(
    tables: Tables, document: Document, entry: Json, name: str
) -> tuple[Layout, ...]:
    """Return the layouts of a parameter set, which SET and GET share unless they have their own."""
    path = ("parameter_sets", name)
    return resolve_layouts(tables, document, path, entry, entry["page"], name)


def _aliases(tables: Tables, entry: Json, role: str, place: Place) -> dict[str, tuple[str, ...]]:
    """Return the other names of a message of a set, each with its words."""
    found = {}
    for other, spelling in entry.get("also_named", {}).items():
        group, rest = split_group(tables, other)
        spelled_words(tables, group, spelling, other, place)
        found[_member(group, role, rest)] = joined(group, role, spelling)
    return found


def _member(group: str, role: str, rest: str) -> str:
    """Return the name of a message of a set."""
    return "_".join(part for part in (group, role.upper(), rest) if part)


def _define_member(
    tables: Tables,
    document: Document,
    entry: Json,
    owner: ParameterSet,
    group: str,
    role: str,
    shared: Callable[[], tuple[Layout, ...]],
) -> None:
    """Add the message for one role; REQ has no content, and GET is its reply."""
    path: KeyPath = ("parameter_sets", owner.name)
    name, page = owner.members[role], entry["page"]
    spelling = spelling_of(entry, split_group(tables, owner.name)[1])
    exchange = dict(entry.get("exchange", {}).get(role, {}))
    at: KeyPath = (*path, role)
    if role == "req":
        layouts: tuple[Layout, ...] = (
            header_layout(tables, document, at, entry.get("req", {}), page),
        )
        if "get" in owner.members:
            exchange.setdefault("answered_by", [owner.members["get"]])
    elif role in entry:  # it has a layout of its own
        layouts = resolve_layouts(tables, document, at, entry[role], page, owner.name)
    else:
        layouts = shared()
    sub_message = entry.get("sub_message")
    message = Message(
        name=name,
        id=entry["ids"][role],
        chapter=document.data["chapter"],
        words=joined(group, role, spelling),
        pages=tuple(sorted({page, entry.get("pages", {}).get(role, page)})),
        direction="to_host" if role == "get" else "to_controller",
        effect=entry.get("effect", _EFFECTS["set"]) if role == "set" else _EFFECTS[role],
        hazard=entry.get("hazard", "") if role == "set" else "",
        summary=entry["summary"],
        title=entry.get("title", ""),
        note=entry.get("note", "") if role == "set" or "set" not in owner.members else "",
        set=(owner.name, role),
        exchange=exchange,
        layouts=tuple(with_sub_message(layout, sub_message) for layout in layouts),
        errata=(),
        place=owner.place,
        group=group.lower(),
        addressee=entry.get("addressee", ""),
        tells=entry.get("tells", ""),
        call=entry.get("call", {}),
        aliases=_aliases(tables, entry, role, owner.place),
        later_pages=entry.get("later_pages", {}),
        overlay=document.overlay,
        sub_message=sub_message,
        not_sent=entry.get("not_sent", "") if role != "get" else "",
        without_flag=entry.get("without_flag", "") if role == "set" else "",
    )
    add_message(tables, message)
    other = entry.get("also_ids", {}).get(role)
    if other is not None:
        add_message(tables, _twin(message, other))


_KINDS = {"commands": "command", "setup_commands": "setup"}  # section -> kind


def define_commands(tables: Tables, document: Document) -> None:
    """Add the commands of a file, then its set-up commands."""
    for section in _KINDS:
        for name, entry in document.data.get(section, {}).items():
            _define_command(tables, document, section, name, entry)


def _define_command(
    tables: Tables, document: Document, section: str, name: str, entry: Json
) -> None:
    path = (section, name)
    place = document.place(*path)
    layouts: list[Layout] = []
    whole = True
    for form in ("request", "reply"):
        if form in entry or form == "request":
            at = (*path, form) if form in entry else path
            layout, all_made = _request_or_reply(tables, document, at, entry, form)
            layouts.append(layout)
            whole = whole and all_made
    size = None if entry.get("size", "none") == "none" else entry["size"]
    if whole:
        _check_size(tables, name, size, {x.form: x.length for x in layouts}, place)
    message = Message(
        name=name,
        id=entry["byte"],
        chapter=document.data["chapter"],
        words=tuple(name.lower().split("_")),
        pages=(entry["page"],),
        direction="to_controller",
        effect=entry.get("effect", ""),
        summary=entry["summary"],
        note=entry.get("note", ""),
        set=None,
        exchange=dict(entry.get("exchange", {})),
        layouts=tuple(layouts),
        errata=(),
        place=place,
        kind=_KINDS[section],
        title=entry["title"],
        keyboard=entry.get("keyboard", ""),
        size=size,
        dummy=entry.get("dummy", False),
        switches_to=entry.get("switches_to"),
        firmware=firmware(entry),
        call=entry.get("call", {}),
        overlay=document.overlay,
    )
    add_message(tables, message)


def _request_or_reply(
    tables: Tables, document: Document, path: KeyPath, command: Json, form: str
) -> tuple[Layout, bool]:
    """Return the request or reply of a command, and whether all its fields could be resolved.

    Its length is the sum of its fields.
    """
    entry, page, at = command.get(form, {}), command["page"], (*path, "fields")
    fields, all_made = resolve_fields(tables, document, at, entry.get("fields", {}), page)
    length = sum(field.format.size for field in fields)
    note, place = entry.get("note", ""), document.place(*path)
    return Layout(form, {}, None, None, length, fields, note, place), all_made


def _check_size(
    tables: Tables, name: str, size: int | None, lengths: Mapping[str, int], place: Place
) -> None:
    """Check that a size matches the data of the request, or else of the reply."""
    request, data = lengths["request"], lengths["request"] or lengths.get("reply", 0)
    if size is None and request:
        what = f"{name} has {request} bytes of data but no size slot"
        hint = "give its `size`; only a command without data may omit it"
        tables.diagnostics.add(place, "SW031", what, hint)
    elif size not in (None, data):
        what = f"{name}: the fields take {data} bytes, but the size is {size}"
        tables.diagnostics.add(place, "SW031", what, "correct the size or the fields")

"""Parameter sets, opened into the messages SET, REQ and GET that share one content."""

from __future__ import annotations

from stagewire_generator.model import Json, Layout, Message, ParameterSet
from stagewire_generator.resolver.layouts import header_layout, resolve_layouts
from stagewire_generator.resolver.messages import add_message
from stagewire_generator.resolver.spelling import joined, spelled_words, spelling_of, split_group
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document

__all__ = ["define_parameter_sets"]

_ROLES = ("set", "req", "get")
_EFFECTS = {"set": "settings", "req": "none", "get": ""}  # where a set does not say otherwise


def define_parameter_sets(tables: Tables, document: Document) -> None:
    """Fill the table of parameter sets from a file, and add the messages of each."""
    for name, entry in document.data.get("parameter_sets", {}).items():
        place = document.place("parameter_sets", name)
        if name in tables.sets:
            tables.diagnostics.add(place, "SW020", f"{name} is defined twice")
            continue
        group, rest = split_group(tables, name)
        words = spelled_words(tables, group, spelling_of(entry, rest), name, place)
        members = {
            role: "_".join(part for part in (group, role.upper(), rest) if part)
            for role in _ROLES
            if role in entry["ids"]
        }
        found = ParameterSet(name, words, members, place)
        tables.sets[name] = found
        if "effect" in entry and "set" not in members:
            what = f"{name} has an effect, which is that of a SET, and no SET"
            tables.diagnostics.add(place, "SW070", what, "remove it")
        for role in members:
            _define_member(tables, document, entry, found, group, role)


def _define_member(
    tables: Tables, document: Document, entry: Json, owner: ParameterSet, group: str, role: str
) -> None:
    """Add the message of one role; REQ has no content, and is answered by GET."""
    path = ("parameter_sets", owner.name)
    name, page = owner.members[role], entry["page"]
    spelling = spelling_of(entry, split_group(tables, owner.name)[1])
    exchange = dict(entry.get("exchange", {}).get(role, {}))
    layouts: tuple[Layout, ...]
    if role == "req":
        at = (*path, "req")
        layouts = (header_layout(tables, document, at, entry.get("req", {}), page),)
        if "get" in owner.members:
            exchange.setdefault("answered_by", [owner.members["get"]])
    else:
        layouts = resolve_layouts(tables, document, path, entry)
    message = Message(
        name=name,
        id=entry["ids"][role],
        chapter=document.data["chapter"],
        words=joined(group, role, spelling),
        pages=tuple(sorted({page, entry.get("pages", {}).get(role, page)})),
        direction="to_host" if role == "get" else "to_controller",
        effect=entry.get("effect", _EFFECTS["set"]) if role == "set" else _EFFECTS[role],
        summary=entry["summary"],
        note=entry.get("note", ""),
        set=(owner.name, role),
        exchange=exchange,
        layouts=layouts,
        errata=(),
        place=owner.place,
        group=group.lower(),
        addressee=entry.get("addressee", ""),
        tells=entry.get("tells", ""),
        overlay=document.overlay,
    )
    add_message(tables, message)

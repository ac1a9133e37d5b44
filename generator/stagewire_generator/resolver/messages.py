"""Messages with a header that stand for themselves; and the table of all messages."""

from __future__ import annotations

from stagewire_generator.model import Json, Layout, Message
from stagewire_generator.resolver.errata import with_errata
from stagewire_generator.resolver.layouts import resolve_layouts
from stagewire_generator.resolver.spelling import spelled_words, spelling_of, split_group
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document

__all__ = ["add_message", "define_messages"]


def define_messages(tables: Tables, document: Document) -> None:
    """Add the messages of a file."""
    for name, entry in document.data.get("messages", {}).items():
        _define_message(tables, document, name, entry)


def add_message(tables: Tables, message: Message) -> None:
    """Add a message with its errata; a name counts once."""
    if message.name in tables.messages:
        tables.diagnostics.add(message.place, "SW020", f"{message.name} is defined twice")
    else:
        tables.messages[message.name] = with_errata(tables, message)


def _define_message(tables: Tables, document: Document, name: str, entry: Json) -> None:
    path = ("messages", name)
    place = document.place(*path)
    group, rest = split_group(tables, name)
    layouts: tuple[Layout, ...] = ()
    if entry.get("layout") != "undocumented":
        layouts = resolve_layouts(tables, document, path, entry)
    message = Message(
        name=name,
        id=None if entry["id"] == "unknown" else entry["id"],
        chapter=document.data["chapter"],
        words=spelled_words(tables, group, spelling_of(entry, rest), name, place),
        pages=tuple(sorted({entry["page"], *entry.get("more_pages", ())})),
        direction=entry["direction"],
        effect=entry.get("effect", ""),
        summary=entry["summary"],
        note=entry.get("note", ""),
        set=None,
        exchange=dict(entry.get("exchange", {})),
        layouts=layouts,
        errata=(),
        place=place,
        group=group.lower(),
        addressee=entry.get("addressee", ""),
        call=entry.get("call", {}),
        overlay=document.overlay,
    )
    add_message(tables, message)

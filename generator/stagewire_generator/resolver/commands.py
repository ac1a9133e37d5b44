"""Commands and set-up commands: a byte, a request and a reply, sizes held against the data."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Json, Layout, Message
from stagewire_generator.resolver.definitions import firmware
from stagewire_generator.resolver.fields import resolve_fields
from stagewire_generator.resolver.messages import add_message
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["define_commands"]

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
    """Return the request or the reply of a command, and whether all its fields could be made.

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
    """Check that a size is that of the data of the request, or else of the reply."""
    request, data = lengths["request"], lengths["request"] or lengths.get("reply", 0)
    if size is None and request:
        what = f"{name} has no size slot, and {request} bytes of data"
        hint = "only a command without data may lack it"
        tables.diagnostics.add(place, "SW031", what, hint)
    elif size not in (None, data):
        what = f"{name}: the size is {size}, the fields take {data} bytes"
        tables.diagnostics.add(place, "SW031", what, "correct the size or the fields")

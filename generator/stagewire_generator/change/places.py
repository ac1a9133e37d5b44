"""Where, in the files of the new side, the thing stands that a change is about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol as Structural

from stagewire_generator.change.change import Change
from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.reader import Files

__all__ = ["find_place", "place_of"]

_IN_UNITS = {
    "unit": "units",
    "family": "families",
    "list": "lists",
    "address": "addresses",
    "alias": "aliases",
    "prefix": "known_prefixes",
    "hardware type": "hardware_types",
}


class _Placed(Structural):
    @property
    def name(self) -> str: ...

    @property
    def place(self) -> Place: ...


def place_of(change: Change, protocol: Protocol, files: Files) -> Place:
    """Return the place of the changed thing, or of the nearest thing around it.

    What is no longer there is placed in the file of the protocol, or in that of the overlay.
    """
    found = find_place(change, protocol, files)
    if found:
        return found
    if "overlay" in files:
        return files["overlay"][0].place("overlay")
    section = "framing" if change.kind == "framing" else "protocol"
    return files["protocol"][0].place(section, change.where.get("attribute", ""))


def find_place(change: Change, protocol: Protocol, files: Files) -> Place | None:
    """Return the place of the changed thing, or None where it stands in none of these files.

    :param protocol: with overlays, of one of which the files are; then what the overlay leaves as the
        protocol has it stands in none of them.
    """
    place = _place(change, protocol, files)
    names = {document.name for documents in files.values() for document in documents}
    return place if place and place.file in names else None


def _place(change: Change, protocol: Protocol, files: Files) -> Place | None:
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    if noun == "message":
        message = next((m for m in protocol.messages if m.name == name), None)
        return _in_message(change, message) if message else None
    if noun in _IN_UNITS:
        path = (_IN_UNITS[noun], name)
        units = next((u for u in files.get("units", ()) if path in u.places), None)
        return units.place(*path, change.where.get("attribute", "")) if units else None
    things: dict[str, Sequence[_Placed]] = {
        "enumeration": protocol.enumerations,
        "flags": protocol.flags,
        "quantity": protocol.quantities,
        "stage": protocol.stages,
        "controller": protocol.controllers,
    }
    return next((thing.place for thing in things.get(noun, ()) if thing.name == name), None)


def _in_message(change: Change, message: Message) -> Place:
    layout = next((x for x in message.layouts if x.form == change.where.get("form")), None)
    return _in_layout(change, layout) if layout else message.place


def _in_layout(change: Change, layout: Layout) -> Place:
    wanted = change.where.get("field")
    return next((f.place for f in layout.all_fields if f.name == wanted), layout.place)

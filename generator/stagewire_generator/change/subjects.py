"""The subject of a change, as errata and references name it, and its position in the new files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol as Structural

from stagewire_generator.change.changes import Change
from stagewire_generator.change.matching import Matches
from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.reader import Files

_RENAMED = ("message", "set", "enumeration", "flags", "quantity", "controller", "stage")


@dataclass(frozen=True, slots=True)
class Subject:
    """A thing in the registry: its noun in ``where``, and its name."""

    noun: str
    name: str

    def __str__(self) -> str:
        """Return the form for errata: the name of a message, or noun and name of anything else."""
        if self.noun in ("message", "set") or not self.name:
            return self.name or self.noun
        return f"{self.noun} {self.name}"


FRAMING = Subject("framing", "")
"""The way to separate frames from the stream; each protocol has one."""


def subject_of(change: Change, protocol: Protocol) -> Subject:
    """Return the subject of a change; the messages of a parameter set are one subject.

    :param protocol: the side that has the subject: the old one if it was removed.
    """
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    if noun == "attribute":
        return FRAMING if change.kind == "framing" else Subject("protocol", change.protocol)
    if noun == "message" and change.kind != "message-removed":
        found = next((m for m in protocol.messages if m.name == name), None)
        return _of_message(found) if found else Subject(noun, name)
    return Subject(noun, name)


def subjects_of(change: Change, protocol: Protocol) -> list[Subject]:
    """Return the changed thing, and also the format if the table of formats caused the change."""
    found = [subject_of(change, protocol)]
    if change.kind == "field-format":
        field = _field(change, protocol)
        name = field.format.name if field else ""
        if str(change.old).startswith(f"{name} ("):  # the entry of the table follows the name
            found.append(Subject("format", name.partition("[")[0]))
    return found


def related(field: Field) -> list[Subject]:
    """Return the subjects related to a field, without its message: its tables, quantity and format."""
    tables = [field.flags, *field.flags_by_unit.values()]
    found = [Subject("flags", table.name) for table in tables if table]
    found += [Subject("enumeration", table.name) for table in field.enumerations]
    if field.quantity:
        found.append(Subject("quantity", field.quantity.name))
    return [*found, Subject("format", field.format.name.partition("[")[0])]


def messages_of(subject: Subject, protocol: Protocol) -> list[Message]:
    """Return the messages of a subject: one, those of a set, or none."""
    return [m for m in protocol.messages if _of_message(m) == subject]


def old_name(subject: Subject, matches: Matches) -> Subject:
    """Return a subject of the new side with its name on the old side."""
    if subject.noun not in _RENAMED:
        return subject
    renamed = _inverse(matches.renamed(subject.noun))
    return Subject(subject.noun, renamed.get(subject.name, subject.name))


def _inverse(names: Mapping[str, str]) -> dict[str, str]:
    return {new: old for old, new in names.items()}


def _of_message(message: Message) -> Subject:
    return Subject("set", message.set[0]) if message.set else Subject("message", message.name)


def _field(change: Change, protocol: Protocol) -> Field | None:
    where = change.where
    fields: Iterable[Field] = (
        field
        for message in protocol.messages
        if message.name == where.get("message")
        for layout in message.layouts
        if layout.form == where.get("form")
        for field in layout.all_fields
    )
    return next((field for field in fields if field.name == where.get("field")), None)


_IN_UNITS = {
    "unit": "units",
    "family": "families",
    "list": "lists",
    "address": "addresses",
    "alias": "aliases",
    "prefix": "known_prefixes",
    "unsupported unit": "unsupported",
    "hardware type": "hardware_types",
}


class _Placed(Structural):
    @property
    def name(self) -> str: ...

    @property
    def place(self) -> Place: ...


def place_of(change: Change, protocol: Protocol, files: Files) -> Place:
    """Return the position of the changed thing, or of the nearest thing around it.

    A removed thing gets a position in the file of the protocol or overlay.
    """
    found = find_place(change, protocol, files)
    if found:
        return found
    if "overlay" in files:
        return files["overlay"][0].place("overlay")
    head, attribute = files["protocol"][0], change.where.get("attribute", "")
    if change.kind != "framing":
        return head.place("protocol")
    paths = [path for path in head.places if path[0] == "framing" and path[-1] == attribute]
    return head.place(*paths[0]) if len(paths) == 1 else head.place("framing")


def find_place(change: Change, protocol: Protocol, files: Files) -> Place | None:
    """Return the position of the changed thing, or None if it is not in any of these files.

    :param protocol: may have overlays applied. If the files are those of an overlay, they do not contain the
        entries that it leaves unchanged.
    """
    place = _place(change, protocol, files)
    names = {document.name for documents in files.values() for document in documents}
    return place if place and place.file in names else None


def _place(change: Change, protocol: Protocol, files: Files) -> Place | None:
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    if noun == "message":
        message = next((m for m in protocol.messages if m.name == name), None)
        return _in_message(change, message) if message else None
    if noun in _IN_UNITS or noun == "setting":
        kind = "quantities" if noun == "setting" else "units"
        path = (_IN_UNITS.get(noun, "settings"), name)
        file = next((file for file in files.get(kind, ()) if path in file.places), None)
        return file.place(*path, change.where.get("attribute", "")) if file else None
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

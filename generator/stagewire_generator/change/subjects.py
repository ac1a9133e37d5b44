"""What a change is about, as one thing that errata and references can name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from stagewire_generator.change.change import Change
from stagewire_generator.change.matching import Matches
from stagewire_generator.model import Field, Message, Protocol

__all__ = ["FRAMING", "Subject", "messages_of", "old_name", "related", "subject_of", "subjects_of"]

_RENAMED = ("message", "set", "enumeration", "flags", "quantity", "controller", "stage")


@dataclass(frozen=True, slots=True)
class Subject:
    """A thing of the registry: the noun that ``where`` has for it, and its name."""

    noun: str
    name: str

    def __str__(self) -> str:
        """Return how an erratum names it: a message by its name, all else with the noun in front."""
        if self.noun in ("message", "set") or not self.name:
            return self.name or self.noun
        return f"{self.noun} {self.name}"


FRAMING = Subject("framing", "")
"""How frames are cut out of the stream; there is one."""


def subject_of(change: Change, protocol: Protocol) -> Subject:
    """Return what a change is about; the messages of a parameter set are one thing.

    :param protocol: the side on which it stands: the old one of what was removed.
    """
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    if noun == "attribute":
        return FRAMING if change.kind == "framing" else Subject("protocol", change.protocol)
    if noun == "message" and change.kind != "message-removed":
        found = next((m for m in protocol.messages if m.name == name), None)
        return _of_message(found) if found else Subject(noun, name)
    return Subject(noun, name)


def subjects_of(change: Change, protocol: Protocol) -> list[Subject]:
    """Return the thing that changed, and the format that changed it if the table of formats did."""
    found = [subject_of(change, protocol)]
    if change.kind == "field-format":
        field = _field(change, protocol)
        name = field.format.name if field else ""
        if str(change.old).startswith(f"{name} ("):  # what the table says is shown with the name
            found.append(Subject("format", name.partition("[")[0]))
    return found


def related(field: Field) -> list[Subject]:
    """Return what a field stands for, besides its message: its tables, its quantity, its format."""
    tables = [field.flags, *field.flags_by_unit.values()]
    found = [Subject("flags", table.name) for table in tables if table]
    if field.enum:
        found.append(Subject("enumeration", field.enum.name))
    if field.quantity:
        found.append(Subject("quantity", field.quantity.name))
    return [*found, Subject("format", field.format.name.partition("[")[0])]


def messages_of(subject: Subject, protocol: Protocol) -> list[Message]:
    """Return the messages that a thing is: one, those of a set, or none."""
    return [m for m in protocol.messages if _of_message(m) == subject]


def old_name(subject: Subject, matches: Matches) -> Subject:
    """Return a thing of the new side as the old side names it."""
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

"""What the witness has of one thing: the parts of ``printed/`` that are about it, without their lines."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from stagewire_generator.change.subjects import FRAMING, Subject, messages_of, related
from stagewire_generator.lint.witness.reading import find_field
from stagewire_generator.model import Field, Message, Protocol

__all__ = ["squeezed", "witnessed"]

# Integers of the witness that say something; all others are lines in the text of the document.
_NUMBERS = frozenset({"page", "structure", "packet", "last_offset"})
_BLANKS = re.compile(r"[ _]+")
# Keys of the chapters: rows that may be about a message, what is about the framing, and rows about others.
_ROWS_OF_MESSAGES = ("rows", "mentions")
_OF_THE_FRAMING = ("prefix", "length", "bytes", "groups", "sizes", "terminator", "addresses")
_ROWS_OF_OTHERS = {
    "unit": ("motor_controllers", "piezo_controllers", "usb_prefixes"),
    "format": ("formats",),
}


def witnessed(subject: Subject, protocol: Protocol, printed: Iterable[Any]) -> set[str]:
    """Return every part of the witness that is about a thing, as canonical JSON.

    :param printed: the data of the files of the witness.
    """
    return {
        json.dumps(_bare(part), sort_keys=True)
        for data in printed
        for part in _parts(subject, protocol, data)
    }


def _parts(subject: Subject, protocol: Protocol, data: Any) -> Iterator[Any]:
    if subject.noun in ("message", "set"):
        for message in messages_of(subject, protocol):
            yield from _sections(message, data)
            yield from _named_rows(message, protocol, data)
    elif subject.noun in ("enumeration", "flags"):
        yield from _tables(subject, protocol, data)
    elif subject == FRAMING:
        yield from (data[key] for key in _OF_THE_FRAMING if key in data)
    else:
        for key in _ROWS_OF_OTHERS.get(subject.noun, ()):
            for row in data.get(key, []):
                if any(subject.name in cell.split("/") for cell in row if isinstance(cell, str)):
                    yield row


def _sections(message: Message, data: Any) -> Iterator[Any]:
    """Yield what is printed under the heading of a message or command."""
    if message.name in data.get("messages", {}):
        yield data["messages"][message.name]
    for section in data.get("commands", []):
        if message.title and section["title"] == message.title:
            yield section


def _named_rows(message: Message, protocol: Protocol, data: Any) -> Iterator[Any]:
    """Yield the rows of contents, overview, mentions and setup tables that name a message."""
    rows = [row for key in _ROWS_OF_MESSAGES for row in data.get(key, [])]
    rows += [row for table in data.get("tables", []) for row in table["rows"]]
    for row in rows:
        printed = str(row.get("name", row.get("says", ""))).rstrip(":;. ")
        bare = _BLANKS.sub("_", printed).removeprefix(protocol.name_prefix)
        if message.name == bare or (message.title and message.title == printed):
            yield row


def _tables(subject: Subject, protocol: Protocol, data: Any) -> Iterator[Any]:
    """Yield the printed lists of values and bits of the fields that have a table, and of the axes."""
    if subject.noun == "enumeration" and subject.name == protocol.framing.get("axes"):
        yield from data.get("axes", [])
    for message in protocol.messages:
        fields = list(_fields_with(subject, message))
        for section in _sections(message, data) if fields else ():
            for printed in section.get("values", []):
                if find_field(fields, printed["of"]):
                    yield printed
            yield from (
                section.get("bits", []) if subject.noun == "flags" else section.get("replies", [])
            )


def _fields_with(subject: Subject, message: Message) -> Iterator[Field]:
    for layout in message.layouts:
        yield from (field for field in layout.all_fields if subject in related(field))


def _bare(part: Any) -> Any:
    """Return a part of the witness without lines: a text that moves in the document says the same."""
    if isinstance(part, Mapping):
        return {
            key: _bare(value) if not _is_line(value) or key in _NUMBERS else None
            for key, value in part.items()
        }
    if isinstance(part, list):
        return [None if _is_line(value) else _bare(value) for value in part]
    return squeezed(part) if isinstance(part, str) else part


def squeezed(text: str) -> str:
    """Return a text with single blanks: who adds another one has not looked at the document again."""
    return " ".join(text.split())


def _is_line(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)

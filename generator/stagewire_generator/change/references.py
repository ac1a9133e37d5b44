"""The references of one side for a subject: errata, pages, the transcription and worked examples.

References are compared as sets: a reference that only the new side has is evidence for a change. A reworded
text or an unchanged page is not evidence.
"""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stagewire_generator.change.subjects import FRAMING, Subject, messages_of, related
from stagewire_generator.lint.witness.reading import find_field
from stagewire_generator.model import Erratum, Json, Message, Protocol
from stagewire_generator.model_fields import Enumeration, Field, FlagTable
from stagewire_generator.model_scales import (
    Conflict,
    Factor,
    Quantity,
    Stage,
)
from stagewire_generator.reader import Files

# Integers of the witness with a meaning; all others are line numbers in the text of the document.
_NUMBERS = frozenset({"page", "structure", "packet", "last_offset"})
_BLANKS = re.compile(r"[ _]+")
# Keys of the chapters: rows that may concern a message, parts about the framing, and rows about others.
_ROWS_OF_MESSAGES = ("rows", "mentions")
_OF_THE_FRAMING = ("prefix", "length", "bytes", "groups", "sizes", "terminator", "addresses")
_ROWS_OF_OTHERS = {
    "unit": ("motor_controllers", "piezo_controllers", "usb_prefixes"),
    "format": ("formats",),
}


def witnessed(subject: Subject, protocol: Protocol, printed: Iterable[Any]) -> set[str]:
    """Return every part of the witness that concerns a subject, as canonical JSON.

    :param printed: the data of the witness files.
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
    """Yield the sections under the heading of a message or command."""
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
    """Yield the printed lists of values and bits for the fields with a table, and of the axes."""
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
    """Return a part of the witness without line numbers, which change when a text only moves."""
    if isinstance(part, Mapping):
        return {
            key: _bare(value) if not _is_line(value) or key in _NUMBERS else None
            for key, value in part.items()
        }
    if isinstance(part, list):
        return [None if _is_line(value) else _bare(value) for value in part]
    return squeezed(part) if isinstance(part, str) else part


def squeezed(text: str) -> str:
    """Return a text with single spaces: a different number of spaces is not evidence."""
    return " ".join(text.split())


def _is_line(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


# The parts of an example that come from the document; the rest follows from the registry or is our own text.
_PRINTED = ("printed", "typed", "shown", "claim", "arithmetic", "equals", "printed_value")
_STATED = ("value", "unit")
_IN_UNITS = {
    "unit": "units",
    "list": "lists",
    "address": "addresses",
    "unsupported unit": "unsupported",
    "hardware type": "hardware_types",
}


@dataclass(frozen=True, slots=True)
class Side:
    """A checked protocol and its files, or one of its overlays, which only refers to its own document.

    :param protocol: the protocol, with the overlay applied if there is one.
    :param files: the files of the protocol or overlay.
    :param renamed: name -> the name on the other side, for comparing things that contain names.
    :param overlay: the name of the overlay; "" for the protocol itself.
    """

    protocol: Protocol
    files: Files
    renamed: Mapping[str, str] = field(default_factory=dict)
    overlay: str = ""

    @property
    def document(self) -> tuple[object, ...]:
        """The identity of the document: title, issue and date."""
        return tuple(squeezed(self._document[key]) for key in ("title", "issue", "date"))

    @property
    def _document(self) -> Json:
        return self.protocol.document_of(self.overlay)

    def references(self, subject: Subject) -> set[Hashable]:
        """Return all references for a subject, in a form that can be compared."""
        return {
            *(("page", self._page(number)) for number in self._numbers(subject)),
            *(("factor", factor) for factor in self._factors(subject)),
            *(("witness", part) for part in self._witnessed(subject)),
            *(("example", *facts) for facts in self._examples(subject)),
            *(("erratum", *facts) for facts in self.errata(subject)),
        }

    def errata(self, subject: Subject) -> set[tuple[Hashable, ...]]:
        """Return the contents of the errata that name a subject, without cosmetic ones."""
        return {
            (
                tuple(map(self._page, erratum.pages)),
                squeezed(erratum.printed),
                squeezed(erratum.encoded),
                frozenset((self._place(at), *sides) for at, sides in erratum.places.items()),
            )
            for erratum in self._errata()
            if erratum.kind != "cosmetic" and self._names(erratum, subject)
        }

    def explained(self, subject: Subject | None = None) -> set[str]:
        """Return the places of all errata, or those of the errata for a subject, without cosmetic ones."""
        return {
            self._place(place)
            for erratum in self._errata()
            if subject is None or (erratum.kind != "cosmetic" and self._names(erratum, subject))
            for place in erratum.places
        }

    def tells_of(self, subject: Subject) -> bool:
        """Whether it has information on a subject; an overlay must have its own."""
        own = any(True for _ in self._numbers(subject)) or self._witnessed(subject)
        return not self.overlay or bool(own)

    def _errata(self) -> Iterator[Erratum]:
        yield from (e for e in self.protocol.errata if e.overlay == self.overlay)

    def _witnessed(self, subject: Subject) -> set[str]:
        printed = (document.data for document in self.files.get("printed", []))
        return witnessed(subject, self.protocol, printed)

    def _numbers(self, subject: Subject) -> Iterator[int]:
        """Yield the page numbers of a subject and its parts."""
        found: list[Any] = [self.protocol.framing.get("page")] if subject == FRAMING else []
        for message in messages_of(subject, self.protocol):
            if message.overlay == self.overlay:
                found += [*message.pages, *(fact.page for fact in message.firmware)]
            fields = (f for layout in message.layouts for f in layout.all_fields)
            found += [f.page for f in fields if f.overlay == self.overlay]
        found.append(self._entry(subject).get("page"))
        for thing in self._things(subject):
            found += [thing.page, *(page for page, _ in _factors(thing))]
        yield from (number for number in found if number is not None)

    def _entry(self, subject: Subject) -> Json:
        """Return the entry of a format, or of a subject in the file of units; otherwise an empty one."""
        if subject.noun == "format":
            head = self.files["overlay" if self.overlay else "protocol"][0]
            found: Json = head.data.get("formats", {}).get(subject.name, {})
            return found
        section = self.protocol.units.get(_IN_UNITS.get(subject.noun, ""), {})
        entry: Json = section.get(subject.name, {})
        return entry if entry.get("overlay", "") == self.overlay else {}

    def _factors(self, subject: Subject) -> Iterator[str]:
        """Yield the factors of a subject as printed in the document."""
        for thing in self._things(subject):
            yield from (squeezed(printed) for _, printed in _factors(thing) if printed)

    def _things(self, subject: Subject) -> Iterator[Enumeration | FlagTable | Quantity | Stage]:
        """Yield the table, quantity or stage for a subject."""
        protocol = self.protocol
        kinds: dict[str, Sequence[Enumeration | FlagTable | Quantity | Stage]] = {
            "enumeration": protocol.enumerations,
            "flags": protocol.flags,
            "quantity": protocol.quantities,
            "stage": protocol.stages,
        }
        for thing in kinds.get(subject.noun, ()):
            if (thing.name, thing.overlay) == (subject.name, self.overlay):
                yield thing

    def _page(self, number: int) -> Hashable:
        """Return a page, or the title of a section, because inserting a section renumbers those after it."""
        sections = self._document.get("sections", [])
        return squeezed(sections[number - 1]) if 0 < number <= len(sections) else number

    def _examples(self, subject: Subject) -> Iterator[tuple[Hashable, ...]]:
        names = {message.name for message in messages_of(subject, self.protocol)} or {subject.name}
        of_message = subject.noun in ("message", "set")
        for example in self.protocol.examples.get("examples", {}).values():
            if example.get("overlay", "") != self.overlay:
                continue
            stated = _stated(example)
            claimed = {text.partition(".")[0] for text in _texts(example.get("claim"))}
            if of_message:
                concerned = example.get("message") in names or claimed & names
            else:
                concerned = claimed & names or names & {*_texts(stated)}
            if concerned:
                facts = {key: example.get(key) for key in _PRINTED}
                facts["page"] = self._page(example.get("page", 0))
                facts["stated"] = [{key: s.get(key) for key in _STATED} for s in stated]
                yield (self._plain(facts),)

    def _names(self, erratum: Erratum, subject: Subject) -> bool:
        """Whether an erratum names a subject, in its lists or as a whole word in its own subject."""
        messages = {message.name for message in messages_of(subject, self.protocol)}
        words = messages | {str(subject)}
        if subject.noun in ("message", "set"):
            words |= {f"{self.protocol.name_prefix}{word}" for word in words}
            listed = {*erratum.messages, *(name.partition(".")[0] for name in erratum.fields)}
            if listed & words:
                return True
        elif subject in self._of_fields(erratum):
            return True
        return any(re.search(rf"(?<!\w){re.escape(w)}(?!\w)", erratum.subject) for w in words)

    def _of_fields(self, erratum: Erratum) -> set[Subject]:
        """Return the tables, quantities and formats of the fields that an erratum names."""
        if not erratum.fields:
            return set()
        return {
            subject
            for message in self.protocol.messages
            for layout in message.layouts
            for field in layout.all_fields
            for owner in (message.name, *(message.set or ())[:1])
            if f"{owner}.{field.name}" in erratum.fields
            for subject in related(field)
        }

    def _place(self, place: str) -> str:
        return "/".join(self.renamed.get(part, part) for part in place.split("/"))

    def _plain(self, value: Any) -> Hashable:
        """Return plain data in a form that can be compared, with the names on the other side."""
        if isinstance(value, dict):
            return tuple(sorted((key, self._plain(item)) for key, item in value.items()))
        if isinstance(value, list):
            return tuple(self._plain(item) for item in value)
        if isinstance(value, str):
            head, dot, rest = squeezed(value).partition(".")
            return self.renamed.get(head, head) + dot + rest
        return repr(value)


def _factors(value: Any) -> Iterator[tuple[int | None, str | None]]:
    """Yield the page and the printed form of each factor in a quantity or stage."""
    if isinstance(value, Factor):
        yield value.page, value.printed
    elif isinstance(value, Conflict):
        for factor in value.factors.values():
            yield from _factors(factor)
    elif isinstance(value, Quantity | Stage):
        scales = (value.scales,) if isinstance(value, Stage) else (value.factor, value.rule)
        for scale in scales:
            yield from _factors(scale)
    elif isinstance(value, Mapping):
        yield value.get("page"), value.get("printed")
        for item in value.values():
            yield from _factors(item)


def _stated(example: Json) -> list[Json]:
    stated: Any = example.get("stated", [])
    return list(stated.values()) if isinstance(stated, dict) else stated


def _texts(value: Any) -> Iterator[str]:
    """Yield all texts in plain data."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from _texts(item)
    elif isinstance(value, list):
        for item in value:
            yield from _texts(item)

"""The resolved registry: immutable, complete, with all references followed.

The resolver builds it from the YAML. Lint rules, targets and the JSON output only read it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from stagewire_generator.diagnostics import Place
from stagewire_generator.model_evidence import EvidenceTable
from stagewire_generator.model_fields import Array, Enumeration, Field, FlagTable
from stagewire_generator.model_scales import Controller, Quantity, Stage

Json = dict[str, Any]

STATES = ("safe_state", "stop_state")
"""Keys of a unit whose messages bring its outputs into a state."""

_NUMBER = re.compile(r"[0-9]{1,4}\Z")  # an issue that readers know by its number


@dataclass(frozen=True, slots=True)
class Layout:
    """One form of a message on the wire."""

    form: str  # header | data | data:dc; request | reply for a command
    when: Mapping[str, str]
    param1: Field | None
    param2: Field | None
    length: int
    fields: tuple[Field, ...]
    note: str
    place: Place
    only_zero: bool = False  # a header with nonzero parameters is not this message
    sent_when: Mapping[str, str] = field(default_factory=dict)  # the context in which a SET has it

    @property
    def all_fields(self) -> tuple[Field, ...]:
        """Header parameters and payload fields, in wire order."""
        if self.param1 is None and self.param2 is None:
            return self.fields
        return (*(p for p in (self.param1, self.param2) if p), *self.fields)

    @property
    def array(self) -> Array | None:
        """The array at the end of the packet, if there is one; ``length`` does not include it."""
        for each in self.fields:
            if each.array is not None:
                return each.array
        return None

    @property
    def longest(self) -> int:
        """The length of the longest packet in bytes."""
        if self.array is None:
            return self.length
        most = {field.name: field.maximum for field in self.fields}
        masks = {name: (1 << most[name].bit_length()) - 1 for name in self.array.masks}
        return self.length + self.array.item.size * self.array.count({**most, **masks})


@dataclass(frozen=True, slots=True)
class Firmware:
    """A note on a firmware version."""

    version: str
    note: str
    page: int | None


@dataclass(frozen=True, slots=True)
class Message:
    """A message of the protocol; a command and its reply are one message with two layouts."""

    name: str
    id: int | None
    chapter: str
    words: tuple[str, ...]
    pages: tuple[int, ...]
    direction: str  # to_controller | to_host | both
    effect: str  # the effect of sending it: none | stream | settings ...; empty if no host sends it
    summary: str
    note: str
    set: tuple[str, str] | None  # (name of the set, its role)
    exchange: Json
    layouts: tuple[Layout, ...]
    errata: tuple[str, ...]
    place: Place
    kind: str = "message"  # message | command | setup
    title: str = ""  # the name in documentation; for a command, the printed heading
    keyboard: str = ""  # the keys to type for the byte of a command
    size: int | None = None  # the value of a command's size slot; None if the slot is left out
    dummy: bool = False  # has no function, and must not be used
    switches_to: str | None = None  # for a setup command: low_level | high_level | power_on
    firmware: tuple[Firmware, ...] = ()
    group: str = ""  # its first word, if that names a group of messages
    hazard: str = ""  # laser | heater | shutter | piezo | zero | inertial; empty if it has none
    addressee: str = ""  # motherboard | unit | every; empty for the controller in a bay
    tells: str = ""  # the information that it reports: identity | bays | counter
    call: Json = field(default_factory=dict)  # method name, and defaults of its arguments
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # other name -> its words
    later_pages: Mapping[str, int] = field(default_factory=dict)  # overlay -> page in its document
    overlay: str = ""
    sub_message: int | None = None  # selects it among the messages of its id
    not_sent: str = ""  # why the library must not send it; empty if it may
    without_flag: str = ""  # who sends it without the data flag; it is then also received so
    twin_of: str = ""  # the message of which this is another id

    @property
    def documented(self) -> bool:
        """Whether the document gives a layout."""
        return bool(self.layouts)

    @property
    def class_name(self) -> str:
        """The name of the generated class, in CamelCase."""
        return _class_name(self.words)

    def page_in(self, overlay: str) -> int | None:
        """Return the page in the document of an overlay, or of the protocol for an empty name."""
        return self.pages[0] if overlay == self.overlay else self.later_pages.get(overlay)

    @property
    def class_aliases(self) -> tuple[str, ...]:
        """The other names of the generated class."""
        return tuple(_class_name(words) for words in self.aliases.values())


def _class_name(words: Iterable[str]) -> str:
    return "".join(word[:1].upper() + word[1:] for word in words)


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """The messages SET, REQ and GET with shared content."""

    name: str
    words: tuple[str, ...]
    members: Mapping[str, str]  # role -> message name
    place: Place


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter of the document; generated code keeps the order of chapters."""

    name: str
    title: str
    page: int
    order: int
    summary: str
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Erratum:
    """An error in the document or the scan, and how the registry encodes it."""

    id: str
    pages: tuple[int, ...]
    subject: str
    messages: tuple[str, ...]
    fields: tuple[str, ...]
    printed: str
    encoded: str
    evidence: str
    kind: str  # wire | meaning | cosmetic
    origin: str  # document | scan
    places: Mapping[str, tuple[str, str]]  # place in the witness -> printed, encoded
    not_compared: tuple[str, ...]  # places in the witness that only people can judge
    place: Place
    overlay: str = ""


def firmware_parts(entry: Json) -> tuple[int, ...]:
    """Return the numbers of the firmware from which a value of a context applies; () is any firmware."""
    return tuple(int(part) for part in entry.get("from_firmware", "").split(".") if part)


def errata_of(example: Json) -> list[str]:
    """Return the errata that an example or a capture refers to."""
    return [*example.get("errata", []), *example.get("breakdown", {}).get("errata", [])]


class Sentence(NamedTuple):
    """A sentence of the document: its page, its position on the page, and a digest of its words."""

    page: int
    number: int
    digest: str


@dataclass(frozen=True, slots=True)
class Rule:
    """A requirement of the document for controllers or hosts, apart from message layouts."""

    id: str
    page: int
    also: tuple[int, ...]  # other pages with the same text
    strength: str  # must | should
    subject: str  # controller | host
    states: str  # the requirement, in our own words
    means: str  # what follows from it; empty if that is obvious
    messages: tuple[str, ...]
    errata: tuple[str, ...]
    waiver: str  # why no check can verify it; empty if one can
    sentences: tuple[Sentence, ...]  # those that state it
    place: Place
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Overlay:
    """A later issue of the document: the entries that it adds or replaces in the registry."""

    name: str
    title: str
    summary: str
    document: Json  # title, issue, date; pages or sections
    place: Place
    default: bool = False  # whether it is applied unless the user leaves it out


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """A protocol with all its entries in the registry."""

    name: str
    title: str
    summary: str
    document: Json
    firmware: tuple[Firmware, ...]
    package: str
    python_title: str
    version: str  # of the package, if it is generated as a project
    name_prefix: str
    formats: Json  # name -> size, signed
    framing: Json  # with the size of every format in it
    id_size: int  # bytes of an id on the wire
    contexts: Json
    chapters: tuple[Chapter, ...]
    messages: tuple[Message, ...]  # sorted by id, sub-message, name; those without an id last
    sets: tuple[ParameterSet, ...]
    enumerations: tuple[Enumeration, ...]
    flags: tuple[FlagTable, ...]
    quantities: tuple[Quantity, ...]
    settings: Json  # name -> the fields that give its value, and the overlay that defines it
    controllers: tuple[Controller, ...]
    stages: tuple[Stage, ...]
    units: Json
    errata: tuple[Erratum, ...]
    rules: tuple[Rule, ...]  # sorted by id
    examples: Json
    captures: Json
    evidence: EvidenceTable = field(default_factory=EvidenceTable)
    overlays: tuple[Overlay, ...] = ()  # in the order in which they were applied
    later_messages: Mapping[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # unit -> from overlays

    def document_of(self, overlay: str) -> Json:
        """Return the document of an overlay, or that of the protocol for an empty name."""
        if not overlay:
            return self.document
        return next(o.document for o in self.overlays if o.name == overlay)

    def document_name(self, overlay: str) -> str:
        """Return a short name of a document, such as ``Issue 37``; empty if it is the only document.

        :param overlay: the overlay of the document; empty for the document of the protocol.
        """
        if not self.overlays:
            return ""
        document = self.document_of(overlay)
        issues = [self.document["issue"], *(o.document["issue"] for o in self.overlays)]
        numbered = _NUMBER.match(document["issue"]) and issues.count(document["issue"]) == 1
        return f"Issue {document['issue']}" if numbered else str(document["title"])

    def messages_of(self, unit: Json) -> frozenset[str]:
        """Return the messages that a unit supports: its printed lists, or those of its family."""
        family = self.units["families"][unit["family"]]
        if "list" not in unit and "messages" in family:
            return frozenset(family["messages"])
        printed = [self.units["lists"][key] for key in self.lists_of(unit)]
        parts = [entry.get(part, ()) for entry in printed for part in ("messages", "completes")]
        return frozenset(name for names in parts for name in names)

    def lists_of(self, unit: Json) -> tuple[str, ...]:
        """Return the printed lists of a unit, or those of the unit that its family is like."""
        units = self.units
        if "list" not in unit and (like := units["families"][unit["family"]].get("like")):
            unit = units["units"][like]
        return (unit["list"], *unit.get("more_lists", ())) if "list" in unit else ()

    @property
    def not_compared(self) -> frozenset[str]:
        """The errata that no program compares: they name no place, and their examples are prose."""
        entries = (
            *self.examples.get("examples", {}).values(),
            *self.captures.get("captures", {}).values(),
        )
        proofs = (entry for entry in entries if "prose" not in entry.get("claim", ()))
        borne = {slug for entry in proofs for slug in errata_of(entry)}
        return frozenset(e.id for e in self.errata if not e.places and e.id not in borne)

    @property
    def id_digits(self) -> int:
        """The number of hexadecimal digits in an id."""
        return 2 * self.id_size

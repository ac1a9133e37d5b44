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
from stagewire_generator.model_scales import Controller, Quantity, Stage

Json = dict[str, Any]

_NUMBER = re.compile(r"[0-9]{1,4}\Z")  # an issue that readers know by its number


@dataclass(frozen=True, slots=True)
class Format:
    """The encoding of a value on the wire, such as ``word``, ``long`` or ``char[8]``."""

    name: str
    size: int  # in bytes; 0 for an array, whose length depends on other fields
    signed: bool
    kind: str  # integer | text | bytes | array

    @property
    def is_odd(self) -> bool:
        """Whether it is an integer of a size without a machine type, such as 24 bits."""
        return self.kind == "integer" and self.size not in (1, 2, 4, 8)

    @property
    def minimum(self) -> int:
        """The smallest integer of the format."""
        return -(1 << (8 * self.size - 1)) if self.signed else 0

    @property
    def maximum(self) -> int:
        """The largest integer of the format."""
        return (1 << (8 * self.size - self.signed)) - 1


@dataclass(frozen=True, slots=True)
class EnumValue:
    """A named value."""

    name: str
    value: int
    note: str
    keyboard: str = ""  # the keys to type for it
    reserved: bool = False  # for future use
    modifier: bool = False  # combined with another value by bitwise OR
    hinders: Json = field(default_factory=dict)  # why it prevents motion
    symbol: str = ""  # its name in the document, if that is another


@dataclass(frozen=True, slots=True)
class Enumeration:
    """Named values of a field; other received values are kept."""

    name: str
    page: int
    summary: str
    values: tuple[EnumValue, ...]
    place: Place
    overlay: str = ""  # name of the overlay that defines it, also in the classes below
    open: str = ""  # why the list may be incomplete; empty if it is complete

    @property
    def modifiers(self) -> tuple[EnumValue, ...]:
        """The values that are combined with another value by bitwise OR."""
        return tuple(value for value in self.values if value.modifier)


@dataclass(frozen=True, slots=True)
class FlagBit:
    """A named bit; bits are counted from zero."""

    name: str
    bit: int
    note: str
    motion: bool = False  # set while something moves
    hinders: Json = field(default_factory=dict)  # why it prevents motion
    symbol: str = ""  # its name in the document, if that is another

    @property
    def mask(self) -> int:
        """The bit as a mask."""
        return 1 << self.bit


@dataclass(frozen=True, slots=True)
class FlagTable:
    """Named bits of a field; other received bits are kept."""

    name: str
    page: int
    summary: str
    format: Format
    bits: tuple[FlagBit, ...]
    place: Place
    overlay: str = ""
    open: str = ""  # as of an enumeration


@dataclass(frozen=True, slots=True)
class Column:
    """The values at one position of the rows of an array."""

    name: str
    each: str = ""  # the field with a bit for each of its values in a row; empty if there is one
    quantity: Quantity | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Array:
    """The rows of integers at the end of a packet."""

    item: Format  # of every integer
    rows: str  # the field with the number of rows
    columns: tuple[Column, ...]

    @property
    def masks(self) -> tuple[str, ...]:
        """The fields whose bits determine the number of values in a row."""
        return tuple(column.each for column in self.columns if column.each)

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields that determine the length."""
        return tuple(dict.fromkeys((self.rows, *self.masks)))

    @property
    def single(self) -> int:
        """The number of values in every row, whatever the masks are."""
        return sum(not column.each for column in self.columns)

    def count(self, values: Mapping[str, Any]) -> int:
        """Return the number of integers, from the values of the fields before the array."""
        bits = sum(int(values[name]).bit_count() for name in self.masks)
        return int(values[self.rows]) * (self.single + bits)


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a payload, or one parameter byte of a header."""

    name: str
    offset: int
    format: Format
    role: str  # value | reserved | constant
    minimum: int
    maximum: int
    page: int
    place: Place
    ranged: bool = False  # the document gives a range
    open: bool = False  # other values or bits are possible here, although the table is complete
    default: int | None = None
    omitted: int | None = (
        None  # sent for a header parameter that is left out; None: it must be given
    )
    constant: int | None = None
    selects: bool = False  # its constant selects the message among those of its id
    target: str = ""  # absolute | relative: the position to move to, or the distance
    quantity: Quantity | None = None
    enum: Enumeration | None = None
    flags: FlagTable | None = None
    flags_by_unit: Mapping[str, FlagTable] = field(default_factory=dict)
    enums_by_unit: Mapping[str, Enumeration] = field(default_factory=dict)
    note: str = ""
    errata: tuple[str, ...] = ()
    overlay: str = ""
    array: Array | None = None
    ranges_by_unit: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    other_range: tuple[int, int] | None = None  # of the units without a range of their own

    @property
    def own_range(self) -> tuple[int, int]:
        """The range without those of individual units; minimum and maximum include them."""
        return self.other_range or (self.minimum, self.maximum)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Its quantity, or those of the columns of its array."""
        columns = self.array.columns if self.array else ()
        found = (self.quantity, *(column.quantity for column in columns))
        return tuple(quantity for quantity in found if quantity)

    @property
    def unit(self) -> str | None:
        """The engineering unit, if the field has one."""
        return (self.quantity.unit or None) if self.quantity else None

    @property
    def enumerations(self) -> tuple[Enumeration, ...]:
        """Its enumeration, and those that apply to individual units."""
        return (*([self.enum] if self.enum else []), *self.enums_by_unit.values())

    @property
    def flag_tables(self) -> tuple[FlagTable, ...]:
        """Its flag table, and those that apply to individual units."""
        return (*([self.flags] if self.flags else []), *self.flags_by_unit.values())

    @property
    def lists_all(self) -> bool:
        """Whether every value or bit is listed, so that device classes send no others.

        Values that differ between units are not listed in one place.
        """
        named = [self.enum] if self.enum else []
        tables: tuple[Enumeration | FlagTable, ...] = (*named, *self.flag_tables)
        if self.enums_by_unit:
            return False
        return bool(tables) and not self.open and not any(table.open for table in tables)


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
        return (*(p for p in (self.param1, self.param2) if p), *self.fields)

    @property
    def array(self) -> Array | None:
        """The array at the end of the packet, if there is one; ``length`` does not include it."""
        return next((field.array for field in self.fields if field.array), None)

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
    addressee: str = ""  # motherboard | unit | every; empty for the controller in a bay
    tells: str = ""  # the information that it reports: identity | bays
    call: Json = field(default_factory=dict)  # method name, and defaults of its arguments
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # other name -> its words
    later_pages: Mapping[str, int] = field(default_factory=dict)  # overlay -> page in its document
    overlay: str = ""
    sub_message: int | None = None  # selects it among the messages of its id
    not_sent: str = ""  # why the library must not send it; empty if it may
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
        found: Json = {"": self.document, **{o.name: o.document for o in self.overlays}}[overlay]
        return found

    def document_name(self, overlay: str) -> str:
        """Return a short name of a document, such as ``Issue 37``; empty if it is the only document.

        :param overlay: the overlay of the document; empty for the document of the protocol.
        """
        if not self.overlays:
            return ""
        document = self.document_of(overlay)
        issues = [
            self.document_of(name)["issue"] for name in ("", *(o.name for o in self.overlays))
        ]
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

"""The resolved registry: immutable, complete, every reference followed.

The resolver makes it from the YAML; lint rules, targets and the JSON output only read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from stagewire_generator.diagnostics import Place

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Format:
    """How a value stands on the wire: ``word``, ``long``, ``char[8]``."""

    name: str
    size: int
    signed: bool
    kind: str  # integer | text | bytes

    @property
    def is_odd(self) -> bool:
        """Whether it is an integer of a size that machines have no integer for, such as 24 bits."""
        return self.kind == "integer" and self.size not in (1, 2, 4, 8)

    @property
    def minimum(self) -> int:
        """The least integer that the format holds."""
        return -(1 << (8 * self.size - 1)) if self.signed else 0

    @property
    def maximum(self) -> int:
        """The greatest integer that the format holds."""
        return (1 << (8 * self.size - self.signed)) - 1


@dataclass(frozen=True, slots=True)
class EnumValue:
    """A named value."""

    name: str
    value: int
    note: str
    keyboard: str = ""  # what is typed for it
    reserved: bool = False  # for future use
    modifier: bool = False  # combined with one of the others by bitwise OR
    hinders: Json = field(default_factory=dict)  # what it says about why nothing moves


@dataclass(frozen=True, slots=True)
class Enumeration:
    """Named values of a field; others that are received are kept."""

    name: str
    page: int
    summary: str
    values: tuple[EnumValue, ...]
    place: Place
    overlay: str = ""  # name of the overlay that it comes from; so wherever there is one
    open: str = ""  # why the list may be incomplete; empty where it is complete

    @property
    def modifiers(self) -> tuple[EnumValue, ...]:
        """The values that are combined with one of the others by bitwise OR."""
        return tuple(value for value in self.values if value.modifier)


@dataclass(frozen=True, slots=True)
class FlagBit:
    """A named bit, counted from zero."""

    name: str
    bit: int
    note: str
    motion: bool = False  # set for as long as something moves
    hinders: Json = field(default_factory=dict)  # what it says about why nothing moves

    @property
    def mask(self) -> int:
        """The bit as a mask."""
        return 1 << self.bit


@dataclass(frozen=True, slots=True)
class FlagTable:
    """Named bits of a field; others that are received are kept."""

    name: str
    page: int
    summary: str
    format: Format
    bits: tuple[FlagBit, ...]
    place: Place
    overlay: str = ""
    open: str = ""  # as of an enumeration


@dataclass(frozen=True, slots=True)
class Factor:
    """An exact scale: its direction in its key, as the registry and its JSON write it."""

    key: str  # counts_per_mm, us_per_count ...
    value: Fraction
    printed: str
    source: str
    page: int | None

    @property
    def counts_per_unit(self) -> Fraction:
        """Counts for one unit, whichever way the registry writes it."""
        return 1 / self.value if self.key.endswith("_per_count") else self.value


@dataclass(frozen=True, slots=True)
class Quantity:
    """A unit and the rule that turns counts into it."""

    name: str
    unit: str
    page: int
    summary: str
    factor: Factor | None
    rule: Json  # {"by": "stage"} and the like; {} when there is a factor
    place: Place
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Controller:
    """A group of units whose scales are the same for a stage."""

    name: str
    units: tuple[str, ...]
    place: Place
    overlay: str = ""
    aliases: Mapping[str, str] = field(default_factory=dict)  # newer unit -> source of its scales
    page: int | None = None

    @property
    def members(self) -> tuple[str, ...]:
        """All units of the group, those newer than the document among them."""
        return (*self.units, *self.aliases)


@dataclass(frozen=True, slots=True)
class Limit:
    """What a stage must not exceed."""

    value: Fraction
    unit: str  # mm | mm/s | mm/s^2
    source: str
    page: int | None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Stage:
    """A stage: exact factors on each controller, and limits; a text instead of either says why none."""

    name: str
    title: str
    page: int
    scales: Mapping[str, Mapping[str, Factor | str]]
    place: Place
    overlay: str = ""
    limits: Mapping[str, Limit | str] = field(default_factory=dict)


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
    open: bool = False  # values or bits may be missing here, although the table is complete
    default: int | None = None
    constant: int | None = None
    target: str = ""  # absolute | relative: what is moved to, or by
    quantity: Quantity | None = None
    enum: Enumeration | None = None
    flags: FlagTable | None = None
    flags_by_unit: Mapping[str, FlagTable] = field(default_factory=dict)
    note: str = ""
    errata: tuple[str, ...] = ()
    overlay: str = ""

    @property
    def unit(self) -> str | None:
        """The engineering unit, if the field has one."""
        return (self.quantity.unit or None) if self.quantity else None

    @property
    def lists_all(self) -> bool:
        """Whether every value or bit is listed: device classes then send no other."""
        tables = [table for table in (self.enum, self.flags) if table]
        tables += self.flags_by_unit.values()
        return bool(tables) and not self.open and not any(table.open for table in tables)


@dataclass(frozen=True, slots=True)
class Layout:
    """One way in which a message stands on the wire."""

    form: str  # header | data | data:dc; of a command request | reply
    when: Mapping[str, str]
    param1: Field | None
    param2: Field | None
    length: int
    fields: tuple[Field, ...]
    note: str
    place: Place
    only_zero: bool = False  # a header with other parameters than zero is not this message

    @property
    def all_fields(self) -> tuple[Field, ...]:
        """Header parameters and payload fields, in wire order."""
        return (*(p for p in (self.param1, self.param2) if p), *self.fields)


@dataclass(frozen=True, slots=True)
class Firmware:
    """What holds for a version of the firmware."""

    version: str
    note: str
    page: int | None


@dataclass(frozen=True, slots=True)
class Message:
    """A message of the protocol; a command and its reply, as two layouts, are one."""

    name: str
    id: int | None
    chapter: str
    words: tuple[str, ...]
    pages: tuple[int, ...]
    direction: str  # to_controller | to_host | both
    effect: str  # what sending it does, none | stream | settings ...; empty: no host sends it
    summary: str
    note: str
    set: tuple[str, str] | None  # (name of the set, its role)
    exchange: Json
    layouts: tuple[Layout, ...]
    errata: tuple[str, ...]
    place: Place
    kind: str = "message"  # message | command | setup
    title: str = ""  # what documentation calls it; of a command, the heading as printed
    keyboard: str = ""  # what is typed for the byte of a command
    size: int | None = None  # what a command sends in its size slot; None: the slot is left out
    dummy: bool = False  # does nothing, and is not to be used
    switches_to: str | None = None  # of a setup command: low_level | high_level | power_on
    firmware: tuple[Firmware, ...] = ()
    group: str = ""  # the first of its words, if that names a group of messages
    addressee: str = ""  # motherboard | unit | every; empty: the controller in a bay
    tells: str = ""  # identity | bays
    call: Json = field(default_factory=dict)  # name of the method, and defaults of its arguments
    overlay: str = ""

    @property
    def documented(self) -> bool:
        """Whether the document gives a layout."""
        return bool(self.layouts)

    @property
    def class_name(self) -> str:
        """The name in CamelCase, as generated classes have it."""
        return "".join(word[:1].upper() + word[1:] for word in self.words)


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """SET, REQ and GET that share one content."""

    name: str
    words: tuple[str, ...]
    members: Mapping[str, str]  # role -> message name
    place: Place


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter of the document; generated code keeps its order."""

    name: str
    title: str
    page: int
    order: int
    summary: str
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Erratum:
    """An error of the document, or of the scan, and what the registry makes of it."""

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
    places: tuple[str, ...]
    place: Place
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Rule:
    """What the document demands of controllers or hosts beside the layouts of messages."""

    id: str
    page: int
    also: tuple[int, ...]  # further pages with the same words
    strength: str  # must | should
    subject: str  # controller | host
    says: str  # in the words of the document
    means: str  # in plain words; empty where the document's own are plain
    messages: tuple[str, ...]
    errata: tuple[str, ...]
    waiver: str  # why no check can see whether it is kept; empty where one can
    place: Place
    overlay: str = ""


@dataclass(frozen=True, slots=True)
class Overlay:
    """A later issue of the document, as far as the registry has it: what it adds and replaces."""

    name: str
    title: str
    summary: str
    document: Json  # title, issue, date; pages or sections
    place: Place


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """Everything that the registry says of one protocol."""

    name: str
    title: str
    summary: str
    document: Json
    firmware: tuple[Firmware, ...]
    package: str
    python_title: str
    version: str  # of the package, where it is a project of its own
    name_prefix: str
    formats: Json  # name -> size, signed
    framing: Json  # with the size beside every format that it names
    id_size: int  # bytes of an id on the wire
    contexts: Json
    chapters: tuple[Chapter, ...]
    messages: tuple[Message, ...]  # sorted by id, then name; those without an id last
    sets: tuple[ParameterSet, ...]
    enumerations: tuple[Enumeration, ...]
    flags: tuple[FlagTable, ...]
    quantities: tuple[Quantity, ...]
    settings: Json  # name -> what tells it; of an overlay with its name
    controllers: tuple[Controller, ...]
    stages: tuple[Stage, ...]
    units: Json
    errata: tuple[Erratum, ...]
    rules: tuple[Rule, ...]  # sorted by id
    examples: Json
    captures: Json
    overlays: tuple[Overlay, ...] = ()  # in the order in which they were laid over

    def document_of(self, overlay: str) -> Json:
        """Return the document of an overlay; that of the protocol itself for an empty name."""
        found: Json = {"": self.document, **{o.name: o.document for o in self.overlays}}[overlay]
        return found

    @property
    def id_digits(self) -> int:
        """Hexadecimal digits of an id as it stands on the wire."""
        return 2 * self.id_size

"""The part of the resolved registry with fields: their formats, named values and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from stagewire_generator.diagnostics import Place
from stagewire_generator.model_scales import Quantity

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Format:
    """The encoding of a value on the wire, such as ``word``, ``long`` or ``char[8]``."""

    name: str
    size: int  # in bytes; 0 for an array, whose length depends on other fields
    signed: bool
    kind: str  # integer | text | bytes | array
    real: bool = False  # an integer that is the bit pattern of an IEEE 754 number

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


NO_BITS: Final = "none"
"""Name of a value without any bit of a table."""


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

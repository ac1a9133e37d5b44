"""Read printed names, numbers and words.

The words, units and notations in a document of commands differ from vendor to vendor, so they are data of the
witness: ``vocabulary`` in its chapter ``format``.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from stagewire_generator.model import Json, Layout, Message
from stagewire_generator.model_fields import Field
from stagewire_generator.real import pattern_of

# Names in the document for bytes without a meaning.
FILLERS = frozenset({"notused", "unused", "reserved", "futureuse", "na"})

# Names in the document for the constant that selects a sub-message.
SELECTORS = frozenset({"submsgid", "msgid"})

_TYPED = re.compile(r"[lw](?=[A-Z])")
_DOTTED = re.compile(r"(0x[0-9A-Fa-f]{4})\.([0-9A-Fa-f]{4})\Z")
_NUMBER = re.compile(r"([-+]?)(?:0[xX])?([0-9A-Fa-f][0-9A-Fa-f,]*)\Z")
_REAL = re.compile(r"([0-9][0-9,]*(?:\.[0-9]+)?)(?: ([nµm]?)[AV])?\Z")
_EXPONENTS = {"n": -9, "µ": -6, "m": -3}
_TIME = re.compile(r"([0-9][0-9,]*)(m?)s\Z")
_SUB_MESSAGE = re.compile(r"(?:[0-9A-F]+ ?[\[(])?(?:0x)?([0-9A-F]+)[\])]?\Z")
_BYTES = re.compile(r"([0-9A-F]{2})[, ]*([0-9A-F]{2})\Z")
_COUNTS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def squash(text: str) -> str:
    """Reduce a name to its letters and digits, so that ``Jog Mode`` is ``jog_mode``."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


def same_name(printed: str, field: Field) -> bool:
    """Whether a printed name matches the field; any filler matches a reserved field.

    Any name for the number of a sub-message matches the constant that selects it.

    A letter for the type before a name, as in lTransitTime or wReserved, does not count.
    """
    for name in (printed, _TYPED.sub("", printed)):
        if squash(name) == squash(field.name):
            return True
        if field.role == "reserved" and squash(name) in FILLERS:
            return True
    return field.selects and squash(printed) in SELECTORS


def pair(printed: Sequence[str], fields: Sequence[Field]) -> Iterator[tuple[int, Field | None]]:
    """Yield the number of each printed name with its field, or with None.

    If the numbers of names and fields differ, names are paired with the fields of the same name, in order.
    """
    if len(printed) == len(fields):
        yield from enumerate(fields)
        return
    left = list(fields)
    for index, name in enumerate(printed):
        at = next((at for at, field in enumerate(left) if same_name(name, field)), None)
        yield index, None if at is None else left[at]
        left = left if at is None else left[at + 1 :]


def data_layout(message: Message, tables: Sequence[Json]) -> Layout | None:
    """Return the layout with data that byte tables show: that of the printed length, or else the first."""
    layouts = [layout for layout in message.layouts if layout.form != "header"]
    lengths = [table["packet"] for table in tables if "packet" in table]
    printed = next((x for length in lengths for x in layouts if x.length == length), None)
    return printed or next(iter(layouts), None)


def find_field(fields: Iterable[Field], printed: str) -> Field | None:
    """Find the field for a printed list of values or range."""
    wanted = squash(printed)
    candidates = list(fields)
    for field in candidates:
        if squash(field.name) in (wanted, wanted.removesuffix("s")):
            return field
    for field in candidates:
        if wanted.removesuffix("s") in squash(field.name) or squash(field.name) in wanted:
            return field
    return None


def number(text: str, maximum: int) -> int | None:
    """Read a printed number, which is hexadecimal if it contains letters or 0x.

    A mask may have a dot after its fourth digit, as in 0x0000.0001.
    A negative hexadecimal number in a byte is its two's complement: -0x01 is 0xFF.
    """
    match = _NUMBER.match(_DOTTED.sub(r"\1\2", text.strip().removeprefix("to ")))
    if match is None:
        return None
    digits = match[2].replace(",", "")
    hexadecimal = "0x" in text.lower() or not digits.isdigit()
    value = int(digits, 16 if hexadecimal else 10)
    value = -value if match[1] == "-" else value
    if value < 0 and maximum == 0xFF and "0x" in text:
        return value & 0xFF
    return value


def sub_message(text: str) -> int | None:
    """Read the number of a sub-message: hexadecimal, in brackets if there are any, as in ``11 [0B]``."""
    match = _SUB_MESSAGE.match(text)
    return int(match[1], 16) if match else None


def two_bytes(text: str) -> int | None:
    """Read two printed bytes, the least significant first, such as ``0B00`` or ``0B,00``."""
    match = _BYTES.match(text)
    return int(match[2] + match[1], 16) if match else None


def limit(text: str, field: Field) -> int | None:
    """Read a printed limit of a field, and convert a time such as 10,000s to counts.

    If the steps depend on the unit, the limit is one of the first unit.
    """
    quantity = field.quantity if field.unit == "ms" else None
    factor = quantity.factor or next(iter(quantity.by_unit.values()), None) if quantity else None
    time = _TIME.match(text)
    if factor and time:
        milliseconds = int(time[1].replace(",", "")) * (1 if time[2] else 1000)
        return int(milliseconds * factor.counts_per_unit)
    if field.format.real:
        return real_limit(text, field.format.size)
    return number(text, field.format.maximum if field.format.size else 0)  # an array has no size


def real_limit(text: str, size: int) -> int | None:
    """Read a printed limit of a real number, such as ``0.1`` or ``1 nA``, as its bit pattern."""
    found = _REAL.match(text.strip())
    if found is None:
        return None
    return pattern_of(f"{found[1].replace(',', '')}e{_EXPONENTS.get(found[2], 0)}", size)


def count(text: str) -> int | str:
    """Read a number in figures or, up to nine, in words; return any other text unchanged."""
    if text in _COUNTS:
        return _COUNTS.index(text)
    return int(text) if text.isdecimal() else text


_PLACEHOLDER = re.compile(r"\{[a-zA-Z0-9:]+\}")


@dataclasses.dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words of one document; without them, no words in it are understood.

    :param slots: slot -> a word that its printed description must contain.
    :param whole_slot: the word that marks a range of the whole size slot, not just of the sizes in use.
    :param no_size: the text for the size of a command that leaves the slot out.
    :param axis: the word after the name of an axis.
    :param cleared: words for a bit that is 0.
    :param signs: words for numbers that may or may not be negative -> ``signed`` or ``unsigned``.
    :param units: unit as printed -> the amount of one count, as from :func:`amount`.
    :param notations: table -> column -> its notation for a byte, with placeholders in braces.
    """

    slots: Mapping[str, str] = dataclasses.field(default_factory=dict)
    whole_slot: str = ""
    no_size: str = ""
    axis: str = ""
    cleared: frozenset[str] = frozenset()
    signs: Mapping[str, str] = dataclasses.field(default_factory=dict)
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    notations: Mapping[str, Mapping[str, str]] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, data: Json) -> Vocabulary:
        """Create a vocabulary from its entry in the witness."""
        signs = {word: sign for sign in ("unsigned", "signed") for word in data[sign]}
        return cls(
            slots=data["slots"],
            whole_slot=data["whole_slot"],
            no_size=data["no_size"],
            axis=data["axis"],
            cleared=frozenset(data["cleared"]),
            signs=signs,
            units={u["printed"]: amount(Fraction(u["factor"]), u["unit"]) for u in data["units"]},
            notations=data["notations"],
        )

    def signed(self, text: str) -> str:
        """Return ``signed`` or ``unsigned`` for words that say so; quote other words."""
        return self.signs.get(text, repr(text))

    def unit(self, text: str) -> str:
        """Return a unit as the amount of one count; return an unknown unit unchanged."""
        return self.units.get(text, text)

    def written(self, table: str, column: str, byte: int, prefix: int = 0, key: str = "") -> str:
        """Return a byte in the notation of a table column.

        :param prefix: the byte before it.
        :param key: the keys to type for it.
        """
        known = {"{key}": key}
        for name, value in (("byte", byte), ("prefix", prefix)):
            known |= {f"{{{name}}}": f"{value}", f"{{{name}:02}}": f"{value:02}"}
            known[f"{{{name}:02X}}"] = f"{value:02X}"
        notation = self.notations.get(table, {}).get(column, "")
        return _PLACEHOLDER.sub(lambda found: known.get(found[0], found[0]), notation)


def amount(factor: Fraction, unit: str) -> str:
    """Return the amount of one count, such as ``1/10 um``."""
    return f"{factor} {unit}"

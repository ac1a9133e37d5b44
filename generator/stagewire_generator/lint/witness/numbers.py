"""Numbers of a command: bytes, sign, unit and range of each, and the bits of a status.

What the registry says of a number although the document does not is a difference, too.
"""

from __future__ import annotations

import re

from stagewire_generator.lint.witness.comparison import NOTHING
from stagewire_generator.lint.witness.reading import count, find_field, limit
from stagewire_generator.lint.witness.section import Section
from stagewire_generator.lint.witness.vocabulary import amount
from stagewire_generator.model import Field, FlagBit, Json
from stagewire_generator.strict_yaml import KeyPath

__all__ = ["compare_bits", "compare_numbers"]


def compare_numbers(section: Section) -> None:
    """Compare every sentence on the form of a number, and every range."""
    told: dict[str, set[str]] = {field.name: set() for field in section.fields}
    for row, path in section.rows("formats"):
        field = _meant(section, row)
        if field is None:
            place = f"format/{section.command.name}"
            section.comparison.differs(place, path, row.get("of", "a number"), "no such field")
            continue
        told[field.name] |= row.keys()
        _format(section, field, row, path)
    for row, path in section.rows("ranges"):
        field = _meant(section, row)
        if field is None:
            place, printed = f"range/{section.command.name}", f"{row['from']} to {row['to']}"
            section.comparison.differs(place, path, printed, "no such field")
            continue
        told[field.name].add("range")
        _range(section, field, row, path)
    for field in section.fields:
        _not_told(section, field, told[field.name])


def _meant(section: Section, row: Json) -> Field | None:
    """Return the field that a sentence means: the only one, or the one that it names."""
    fields = section.fields
    if len(fields) == 1:
        return fields[0]
    return find_field(fields, row["of"]) if "of" in row else None


def _place(kind: str, section: Section, field: Field) -> str:
    name = section.command.name
    return f"{kind}/{name}" if len(section.fields) == 1 else f"{kind}/{name}/{field.name}"


def _format(section: Section, field: Field, row: Json, path: KeyPath) -> None:
    same, place = section.comparison.same, _place("format", section, field)
    words = section.comparison.vocabulary
    if "bytes" in row:
        same(f"{place}/bytes", (*path, "bytes"), count(row["bytes"]), field.format.size)
    if "sign" in row:
        same(f"{place}/signed", (*path, "sign"), words.signed(row["sign"]), field.format.signed)
    if "unit" in row:
        same(f"{place}/unit", (*path, "unit"), words.unit(row["unit"]), _unit_of(field))


def _range(section: Section, field: Field, row: Json, path: KeyPath) -> None:
    place = _place("range", section, field)
    for key, bound in (("from", "minimum"), ("to", "maximum")):
        printed, encoded = limit(row[key], field), getattr(field, bound)
        section.comparison.same(f"{place}/{bound}", (*path, key), printed, encoded)


def _unit_of(field: Field) -> str:
    """Return what one count is."""
    factor = field.quantity.factor if field.quantity else None
    return amount(1 / factor.counts_per_unit, field.unit or "") if factor else "no unit"


def _not_told(section: Section, field: Field, told: set[str]) -> None:
    """Note what the registry says of a number although the document does not."""
    differs, place = section.comparison.differs, _place("format", section, field)
    number = field.format.kind == "integer" and field.role == "value"
    if number and field.format.size > 1 and "sign" not in told:
        differs(f"{place}/signed", section.path, NOTHING, field.format.signed)
    if field.quantity and "unit" not in told:
        differs(f"{place}/unit", section.path, NOTHING, _unit_of(field))
    if field.ranged and "range" not in told:
        for bound in ("minimum", "maximum"):
            encoded = getattr(field, bound)
            if encoded != getattr(field.format, bound):
                place = _place("range", section, field)
                differs(f"{place}/{bound}", section.path, NOTHING, encoded)


def compare_bits(section: Section) -> None:
    """Compare the rows of a table of bits with the names of the bits."""
    tables = [field.flags.bits for field in section.fields if field.flags]
    known = {str(bit.bit): bit for bits in tables[:1] for bit in bits}
    rows = section.rows("bits")
    for row, path in rows:
        place = f"bits/{section.command.name}/{row['bit']}"
        if row["bit"] in known:
            _bit(section, place, known.pop(row["bit"]), row, path)
        else:
            section.comparison.differs(place, path, row.get("one", row.get("because")), NOTHING)
    for number, bit in known.items() if rows else ():  # one table may serve several commands
        place = f"bits/{section.command.name}/{number}"
        section.comparison.differs(place, (*section.path, "bits"), NOTHING, bit.name)


def _bit(section: Section, place: str, bit: FlagBit, row: Json, path: KeyPath) -> None:
    """Compare: the name must say what the bit means when it is set, and not what it means else."""
    name = bit.name.lower().split("_")
    if "always" in row:
        printed, right = f"always {row['always']}, {row['because']}", row["always"] == "1"
        right = right and set(name) <= _words(row["because"])
    else:
        of = f"{row['of']} " if "of" in row else ""
        printed = f"0 {of}{row['zero']}, 1 {of}{row['one']}"
        cleared = section.comparison.vocabulary.cleared
        right = _says(of + row["one"], name, cleared)
        right = right and not _says(of + row["zero"], name, cleared)
    if right:
        section.comparison.compared += 1
    else:
        section.comparison.differs(place, path, printed, bit.name)


def _says(text: str, name: list[str], cleared: frozenset[str]) -> bool:
    """Whether all words of a name are in a text, and none that is said of a bit that is 0."""
    words = _words(text)
    return words.issuperset(name) and not words & cleared


def _words(text: str) -> set[str]:
    """Return the words of a text, each also without the s of a plural."""
    words = re.findall(r"[a-z0-9]+", text.lower())
    return {*words, *(word.removesuffix("s") for word in words)}

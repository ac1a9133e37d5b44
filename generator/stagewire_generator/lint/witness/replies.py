"""Replies in ASCII: single characters are values of an enumeration, longer ones are texts."""

from __future__ import annotations

from stagewire_generator.lint.witness.comparison import NOTHING
from stagewire_generator.lint.witness.reading import squash
from stagewire_generator.lint.witness.section import Section
from stagewire_generator.model import EnumValue, Json
from stagewire_generator.strict_yaml import KeyPath

__all__ = ["compare_replies"]

_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def compare_replies(section: Section) -> None:
    """Compare every reply that is given as text, and look for values that none is given for."""
    values = _values(section)
    printed = set()
    for row, path in section.rows("replies"):
        if len(row["text"]) == 1:
            printed.add(ord(row["text"]))
            _character(section, values.get(ord(row["text"])), row, path)
        else:
            _text(section, row, path)
    for value in values.values():
        if value.value not in printed:
            place = f"reply/{section.command.name}/{value.name}"
            section.comparison.differs(place, section.path, NOTHING, chr(value.value))


def _values(section: Section) -> dict[int, EnumValue]:
    """Return the values that a reply of one byte has."""
    fields = next((x.fields for x in section.command.layouts if x.form == "reply"), ())
    enum = fields[0].enum if len(fields) == 1 else None
    return {value.value: value for value in enum.values} if enum else {}


def _character(section: Section, value: EnumValue | None, row: Json, path: KeyPath) -> None:
    place = f"reply/{section.command.name}"
    if value is None:
        section.comparison.differs(f"{place}/{ord(row['text'])}", path, row["text"], NOTHING)
        return
    section.comparison.compared += 1
    place = f"{place}/{value.name}"
    if "dec" in row:
        section.comparison.same(f"{place}/dec", path, row["dec"], str(value.value))
    if "means" in row:
        section.comparison.same(place, path, squash(row["means"]), squash(value.name))


def _text(section: Section, row: Json, path: KeyPath) -> None:
    """Compare a text with the length of the reply, and with what is said of its bytes."""
    place, text = f"reply/{section.command.name}", row["text"]
    section.comparison.same(f"{place}/length", path, len(text), section.length("reply"))
    for ordinal in row.get("spaces", []):
        number = _ORDINALS.index(ordinal) if ordinal in _ORDINALS else len(text)
        section.comparison.same(f"{place}/{ordinal}", path, " ", text[number : number + 1])

"""Compare the printed document with the registry, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two common
kinds of difference have one place for all their occurrences: ``names/blanks`` (underscores lost in the scan)
and ``headers/bar`` (the ``d|`` of a data frame, scanned as ``d``). A document of commands without a header
has chapters of other kinds, and places such as ``command/START_MOTOR/hex``; a vocabulary in one of these
chapters defines the meaning of its words. The chapter of statements can name any fact; see ``statements.py``.
All other chapters have a section for each message: its heading,
byte tables, field tables, lists of values, and ranges.
"""

from __future__ import annotations

import re
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from stagewire_generator.framing import FRAMINGS, part
from stagewire_generator.lint.witness.comparison import NOTHING, Comparison, Shared
from stagewire_generator.lint.witness.reading import (
    Vocabulary,
    data_layout,
    find_field,
    limit,
    number,
    pair,
    squash,
    sub_message,
    two_bytes,
)
from stagewire_generator.lint.witness.statements import CHAPTER
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.strict_yaml import Document, KeyPath

CompareTables: TypeAlias = Callable[[Comparison, Message, list[Json], KeyPath], None]
"""Compares the byte tables of a message at a path."""

_LONGEST_RUN = 64  # maximum number of values in a range with "to"
_SYMBOL = re.compile(r"[A-Z][A-Z0-9]*_[A-Z0-9_]+\Z")
_WORD = re.compile(r"[A-Za-z0-9]+")
_BIT = re.compile(r"[1-9][0-9]?\Z")
_NAME = re.compile(r"[A-Z][a-z]+[A-Za-z]*[0-9]*\Z")


def compare_section(
    comparison: Comparison, name: str, entry: Json, tables: CompareTables | None
) -> None:
    """Compare the section of the witness for one message.

    :param tables: compares its byte tables; None if the framing has no header.
    """
    path: KeyPath = ("messages", name)
    message = comparison.messages.get(name) or _sub_message(comparison, entry)
    if message is None:
        comparison.unknown.append((comparison.document.place(*path), name))
        return
    name = message.name  # the document may print another of its names
    comparison.witnessed.add(name)
    comparison.headed.add(name)
    heading = entry["heading"]
    at = (*path, "heading")
    comparison.same(f"heading/{name}/id", at, heading["id"], comparison.id_of(message))
    page = entry["sub_message" if "sub_message" in entry else "heading"]["page"]
    comparison.same(f"heading/{name}/page", at, page, comparison.page_of(message))
    if "sub_message" in entry:
        _sub_heading(comparison, message, entry, (*path, "sub_message"))
    printed = entry.get("tables", [])
    if tables:
        tables(comparison, message, printed, (*path, "tables"))
    elif printed:
        what = f"{name}: byte tables of a header, which this framing does not have"
        comparison.misplace((*path, "tables"), what)
    if "rows" in entry:
        _rows(comparison, message, entry["rows"], entry.get("tables", ()), (*path, "rows"))
    aliases = _by_row(message, entry.get("rows", []), entry.get("tables", ()))
    for index, printed in enumerate(entry.get("values", [])):
        _values(comparison, message, printed, aliases, (*path, "values", index))
    for index, printed in enumerate(entry.get("ranges", [])):
        _limits(comparison, message, printed, aliases, (*path, "ranges", index))


def _sub_message(comparison: Comparison, entry: Json) -> Message | None:
    """Return the message with the id and the sub-message of a section; it may have another name there."""
    if "sub_message" not in entry:
        return None
    value = sub_message(entry["sub_message"]["id"])
    found = comparison.shared_by("", entry["heading"]["id"])
    return next((message for message in found if message.sub_message == value), None)


def _sub_heading(comparison: Comparison, message: Message, entry: Json, path: KeyPath) -> None:
    """Compare every number of a sub-message, and remember the heading that it shares."""
    part = entry["sub_message"]
    place = f"sub_message/{message.name}"
    value = message.sub_message
    comparison.same(f"{place}/id", path, sub_message(part["id"]), value)
    for _, text in (part["bytes"],) if "bytes" in part else ():
        comparison.same(f"{place}/bytes", path, two_bytes(text), value)
    for _, _, listed in part.get("listed", ()):
        comparison.same(f"{place}/listed", path, sub_message(listed), value)
    if message.id is not None:
        comparison.shared[part["of"]] = Shared(message.id, entry["heading"]["page"])


def _rows(
    comparison: Comparison,
    message: Message,
    rows: list[list[str]],
    tables: Sequence[Json],
    path: KeyPath,
) -> None:
    fields = _listed_fields(message, tables)
    place = f"rows/{message.name}"
    names = [row[0] for row in rows]
    comparison.names(f"{place}/{{}}/name", path, names, fields)
    formats = {}
    for index, field in pair(names, fields):
        format = rows[index][1] or ""
        if field:
            formats[field.name] = format
        else:
            comparison.differs(f"{place}/{squash(names[index])}/format", path, format, NOTHING)
    for field in fields:
        comparison.compared += 1
        printed = formats.get(field.name, NOTHING).lower()
        # A single char is an unsigned byte, and may be a number
        if field.array and printed.endswith(f"array of {field.format.name}"):
            continue
        if printed != field.format.name and (printed, field.format.name) != ("char", "byte"):
            comparison.differs(f"{place}/{field.name}/format", path, printed, field.format.name)


def _listed_fields(message: Message, tables: Sequence[Json]) -> tuple[Field, ...]:
    """Return the fields in a field table: those of the packet, or else of the header."""
    data = data_layout(message, tables)
    if data is not None:
        return data.fields
    return message.layouts[0].all_fields if message.layouts else ()


def _by_row(message: Message, rows: list[list[str]], tables: Sequence[Json]) -> dict[str, Field]:
    """Return printed field name -> field, for the rows of the field table."""
    names = [row[0] for row in rows]
    pairs = pair(names, _listed_fields(message, tables))
    return {squash(names[index]): field for index, field in pairs if field}


def _values(
    comparison: Comparison,
    message: Message,
    printed: Json,
    aliases: dict[str, Field],
    path: KeyPath,
) -> None:
    place = f"values/{message.name}/{squash(printed['of'])}"
    if "table" in printed:
        place += f"/{squash(printed['table'])}"
    field = _field_of_values(comparison, message, printed["of"], aliases)
    if field is None:
        for row in printed["rows"]:
            comparison.differs(f"{place}/{squash(row[0])}", path, row[-1], "no list of values")
        return
    if field.format.kind == "bytes":
        return  # the note describes the parts of a byte string
    known = _known_values(field, printed.get("table", ""))
    found: dict[int, str] = {}
    for row in printed["rows"]:
        if "future" in row[-1].lower():
            continue
        value = number(row[0], field.format.maximum)
        if value is None:
            comparison.differs(f"{place}/{squash(row[0])}", path, row[0], NOTHING)
            continue
        if row[0].startswith("to ") and found:  # "0x02 Bay 2 to 0x06 Bay 6"
            between = range(next(reversed(found)) + 1, value)
            found.update(dict.fromkeys(between[:_LONGEST_RUN], ""))
        found[value] = row[1] if len(row) == 2 else ""
        if len(row) == 3 and _BIT.match(row[1]):  # the document counts bits from one
            mask = 1 << (int(row[1]) - 1)
            comparison.same(f"{place}/{value:#x}/bit", path, f"{mask:#x}", f"{value:#x}")
    for value in sorted(found.keys() | known.keys()):
        name, fact = known.get(value, (NOTHING, ""))
        name = name.lower()
        symbol = found[value].lower() or f"{value:#x}" if value in found else NOTHING
        if value in found and value in known and not _SYMBOL.match(found[value]):
            symbol = name  # only the value is printed, or a description
        elif value in known:  # the symbol is printed, or an erratum has to name it
            comparison.tables |= {f"{fact}/{key}" for key in ("value", "bit", "symbol")}
        comparison.same(f"{place}/{value:#x}", path, symbol, name)


def _field_of_values(
    comparison: Comparison, message: Message, printed: str, aliases: dict[str, Field]
) -> Field | None:
    """Return the field for a printed list of values."""
    field = aliases.get(squash(printed))
    if field is not None and (field.enum or field.flags):
        return field
    fields = [
        field
        for field in _all_fields(comparison, message)
        if field.enum or field.flags or field.format.kind == "bytes"
    ]
    only = fields[0] if len({field.name for field in fields}) == 1 else None
    return find_field(fields, printed) or only


def _known_values(field: Field, table: str) -> dict[int, tuple[str, str]]:
    """Return the symbol and the path of each value or bit of a field, for the unit of the table."""
    if field.enum:
        enum = next(
            (enum for unit, enum in field.enums_by_unit.items() if is_named(unit, table)),
            field.enum,
        )
        path = f"enumerations/{enum.name}/values"
        return {v.value: (v.symbol or v.name, f"{path}/{v.name}") for v in enum.values}
    assert field.flags
    flags = next(
        (flags for unit, flags in field.flags_by_unit.items() if is_named(unit, table)),
        field.flags,
    )
    path = f"flags/{flags.name}/bits"
    return {bit.mask: (bit.symbol or bit.name, f"{path}/{bit.name}") for bit in flags.bits}


def is_named(unit: str, title: str) -> bool:
    """Whether the title of a table names a unit or its series, such as BBD20x or KLS."""
    words = _WORD.findall(title)
    series = {word[:-1].replace("X", "x") for word in words if word[-1] in "Xx"}
    letters = unit.rstrip(string.digits)
    return unit in words or letters in words or (unit[:-1] in series and unit[-1].isdigit())


def _limits(
    comparison: Comparison,
    message: Message,
    printed: Json,
    aliases: dict[str, Field],
    path: KeyPath,
) -> None:
    field = aliases.get(squash(printed["of"]))
    field = field or find_field(_all_fields(comparison, message), printed["of"])
    if field is None:
        place = f"ranges/{message.name}/{squash(printed['of'])}"
        comparison.differs(place, path, printed["of"], "no such field")
        return
    fixed = field.constant if field.constant is not None else field.default
    lowest, highest = field.own_range
    if field.enum and not field.ranged and not field.open:  # the values are the range
        values = [value.value for value in field.enum.values]
        lowest, highest = min(values), max(values)
    for key, encoded in (
        ("from", lowest),
        ("to", highest),
        ("default", field.default),
        ("fixed", fixed),
    ):
        if key not in printed or _NAME.match(printed[key]):
            continue  # a limit may itself be a field, such as Wnd0
        if key == "fixed" and fixed is None:
            continue  # fixed for some units only, which the note names
        place = f"ranges/{message.name}/{field.name}/{key}"
        if limit(printed[key], field) == encoded:
            comparison.compared += 1
        else:
            comparison.differs(place, path, printed[key], encoded)


def _all_fields(comparison: Comparison, message: Message) -> list[Field]:
    """Return the fields that a table may refer to: those of the message, then those of its set."""
    found = [field for layout in message.layouts for field in layout.all_fields]
    if message.set:
        for other in comparison.protocol.messages:
            if other.set and other.set[0] == message.set[0] and other is not message:
                found += [f for layout in other.layouts for f in layout.all_fields]
    return found


@dataclass(frozen=True, slots=True)
class Witness:
    """The way to compare the document of a protocol, which depends on the framing.

    :param chapters: name of a chapter with its own form -> the function that compares it.
    :param sections: whether every other chapter has a section for each message.
    :param tables: compares the byte tables in such a section; None if there are no such tables.
    """

    chapters: Mapping[str, Callable[[Comparison], None]]
    sections: bool = False
    tables: CompareTables | None = None


def compare_witness(
    protocol: Protocol, printed: Sequence[Document], overlay: str = ""
) -> Comparison:
    """Compare all files of the witness with the registry: first sections, then the lists that refer to them.

    :param overlay: the overlay whose document is compared; empty for the protocol itself.
    """
    if overlay:
        # Notes on firmware versions may refer to pages of the other document
        protocol = replace(protocol, document=protocol.document_of(overlay), firmware=())
    words = [d.data["vocabulary"] for d in printed if "vocabulary" in d.data]
    vocabulary = Vocabulary.of(words[0]) if words else None
    comparison = Comparison(protocol, Document("printed", {}, {}, overlay), vocabulary)
    witness: Witness = part(protocol.framing["kind"], "witness")
    named = {chapter for kind in FRAMINGS for chapter in part(kind, "witness").chapters}
    for document in printed:
        comparison.document = document
        chapter = document.data["chapter"]
        if chapter == CHAPTER:
            continue
        if witness.sections and chapter not in named:
            for name, entry in document.data["messages"].items():
                compare_section(comparison, name, entry, witness.tables)
        elif chapter not in witness.chapters:  # a chapter of a document of the other kind
            comparison.unknown.append((document.place("chapter"), chapter))
    for document in printed:
        compare = witness.chapters.get(document.data["chapter"])
        if compare:
            comparison.document = document
            compare(comparison)
    return comparison

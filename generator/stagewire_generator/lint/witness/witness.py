"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``). A document of commands without a
header has chapters of its own, and places such as ``command/START_MOTOR/hex``; what its words mean is
told by a vocabulary in one of them. The other chapters have a section for each message: its heading, byte
tables, field tables, lists of values, ranges.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from stagewire_generator.framing import FRAMINGS, part
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.reading import (
    Vocabulary,
    find_field,
    limit,
    number,
    same_name,
    squash,
)
from stagewire_generator.model import Field, Json, Message, Protocol
from stagewire_generator.strict_yaml import Document, KeyPath

CompareTables: TypeAlias = Callable[[Comparison, Message, list[Json], KeyPath], None]
"""Compares the byte tables of a message, whose path is given."""

_LONGEST_RUN = 64  # values that "to" may stand for
_SYMBOL = re.compile(r"[A-Z][A-Z0-9]*_[A-Z0-9_]+\Z")
_BIT = re.compile(r"[1-9][0-9]?\Z")
_NAME = re.compile(r"[A-Z][a-z]+[A-Za-z]*[0-9]*\Z")


def compare_section(
    comparison: Comparison, name: str, entry: Json, tables: CompareTables | None
) -> None:
    """Compare everything that the witness has of one message.

    :param tables: compares its byte tables; None where its framing has no header that they could show.
    """
    path: KeyPath = ("messages", name)
    message = comparison.messages.get(name)
    if message is None:
        comparison.unknown.append((comparison.document.place(*path), name))
        return
    comparison.witnessed.add(name)
    comparison.headed.add(name)
    heading = entry["heading"]
    at = (*path, "heading")
    comparison.same(f"heading/{name}/id", at, heading["id"], comparison.id_of(message))
    comparison.same(f"heading/{name}/page", at, heading["page"], message.pages[0])
    printed = entry.get("tables", [])
    if tables:
        tables(comparison, message, printed, (*path, "tables"))
    elif printed:
        comparison.misplace((*path, "tables"), f"{name}: tables of the bytes of a header")
    if "rows" in entry:
        _rows(comparison, message, entry["rows"], (*path, "rows"))
    aliases = _by_row(message, entry.get("rows", []))
    for index, printed in enumerate(entry.get("values", [])):
        _values(comparison, message, printed, aliases, (*path, "values", index))
    for index, printed in enumerate(entry.get("ranges", [])):
        _limits(comparison, message, printed, aliases, (*path, "ranges", index))


def _rows(comparison: Comparison, message: Message, rows: list[list[str]], path: KeyPath) -> None:
    fields = _listed_fields(message)
    place = f"rows/{message.name}"
    if len(rows) != len(fields):
        printed = ", ".join(row[0] for row in rows)
        comparison.differs(f"{place}/count", path, printed, ", ".join(f.name for f in fields))
        by_name = {squash(f.name): f for f in fields}
        pairs = [(row, by_name[squash(row[0])]) for row in rows if squash(row[0]) in by_name]
    else:
        pairs = list(zip(rows, fields, strict=True))
    for row, field in pairs:
        if not same_name(row[0], field):
            comparison.differs(f"{place}/{field.name}/name", path, row[0], field.name)
        comparison.compared += 1
        printed = (row[1] or "").lower()
        # A single char is one byte without a sign, and may be a number
        if printed != field.format.name and (printed, field.format.name) != ("char", "byte"):
            comparison.differs(f"{place}/{field.name}/format", path, printed, field.format.name)


def _listed_fields(message: Message) -> tuple[Field, ...]:
    """Return the fields that a field table lists: of the packet, else of the header."""
    data = next((x for x in message.layouts if x.form != "header"), None)
    if data is not None:
        return data.fields
    return message.layouts[0].all_fields if message.layouts else ()


def _by_row(message: Message, rows: list[list[str]]) -> dict[str, Field]:
    """Return what each printed field name means, where the field table has a row for each."""
    fields = _listed_fields(message)
    if len(rows) != len(fields):
        return {}
    return {squash(row[0]): field for row, field in zip(rows, fields, strict=True)}


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
        comparison.differs(place, path, printed["of"], "no list of values")
        return
    if field.format.kind == "bytes":
        return  # the parts of a byte string are told in its note
    known = _known_values(field, printed.get("table", ""))
    found: dict[int, str] = {}
    unread = []
    for row in printed["rows"]:
        comparison.compared += 1
        if "future" in row[-1].lower():
            continue
        value = number(row[0], field.format.maximum)
        if value is None:
            unread.append(row[0])
            continue
        if row[0].startswith("to ") and found:  # "0x02 Bay 2 to 0x06 Bay 6"
            between = range(next(reversed(found)) + 1, value)
            found.update(dict.fromkeys(between[:_LONGEST_RUN], ""))
        found[value] = row[1] if len(row) == 2 else ""
        if len(row) == 3 and _BIT.match(row[1]):  # the document counts bits from one
            mask = 1 << (int(row[1]) - 1)
            comparison.same(f"{place}/{value:#x}/bit", path, f"{mask:#x}", f"{value:#x}")
    if set(found) != set(known) or unread:
        extra = [f"{n:#x}" for n in sorted(set(found) - set(known))] + unread
        missing = [known[n] for n in sorted(set(known) - set(found))]
        comparison.differs(
            place,
            path,
            f"{', '.join(extra) or 'nothing'} beyond the registry",
            f"{', '.join(missing) or 'nothing'} beyond the document",
        )
    for value, symbol in found.items():
        if _SYMBOL.match(symbol) and value in known:
            same = (symbol.lower(), known[value].lower())
            comparison.same(f"{place}/{symbol.lower()}", path, *same)


def _field_of_values(
    comparison: Comparison, message: Message, printed: str, aliases: dict[str, Field]
) -> Field | None:
    """Return the field that a list of values is printed for."""
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


def _known_values(field: Field, table: str) -> dict[int, str]:
    """Return the values that the registry has for a field, as its unit has them."""
    if field.enum:
        return {value.value: value.name for value in field.enum.values}
    assert field.flags
    flags = field.flags_by_unit.get(table.split(" ")[0], field.flags)
    return {bit.mask: bit.name for bit in flags.bits}


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
    for key, encoded in (
        ("from", field.minimum),
        ("to", field.maximum),
        ("default", field.default),
        ("fixed", fixed),
    ):
        if key not in printed or _NAME.match(printed[key]):
            continue  # a limit may itself be a field, such as Wnd0
        if key == "fixed" and fixed is None:
            continue  # fixed for some units only; the note says for which
        place = f"ranges/{message.name}/{field.name}/{key}"
        if limit(printed[key], field) == encoded:
            comparison.compared += 1
        else:
            comparison.differs(place, path, printed[key], encoded)


def _all_fields(comparison: Comparison, message: Message) -> list[Field]:
    """Return the fields that a table may mean: of the message, then of its set."""
    found = [field for layout in message.layouts for field in layout.all_fields]
    if message.set:
        for other in comparison.protocol.messages:
            if other.set and other.set[0] == message.set[0] and other is not message:
                found += [f for layout in other.layouts for f in layout.all_fields]
    return found


@dataclass(frozen=True, slots=True)
class Witness:
    """How the document of a protocol is compared, by its framing.

    :param chapters: chapters that have a form of their own -> what compares them.
    :param sections: whether every other chapter has a section for each message.
    :param tables: compares the byte tables in such a section; None where there can be none.
    """

    chapters: Mapping[str, Callable[[Comparison], None]]
    sections: bool = False
    tables: CompareTables | None = None


def compare_witness(
    protocol: Protocol, printed: Sequence[Document], overlay: str = ""
) -> Comparison:
    """Compare all files of the witness with the registry; sections first, as lists refer to them.

    :param overlay: whose document it is that prints this; without it that of the protocol itself.
    """
    if overlay:
        # What holds for versions of the firmware has pages of the other document, too
        protocol = replace(protocol, document=protocol.document_of(overlay), firmware=())
    words = [d.data["vocabulary"] for d in printed if "vocabulary" in d.data]
    vocabulary = Vocabulary.of(words[0]) if words else None
    comparison = Comparison(protocol, Document("printed", {}, {}, overlay), vocabulary)
    witness: Witness = part(protocol.framing["kind"], "witness")
    named = {chapter for kind in FRAMINGS for chapter in part(kind, "witness").chapters}
    for document in printed:
        comparison.document = document
        chapter = document.data["chapter"]
        if witness.sections and chapter not in named:
            for name, entry in document.data["messages"].items():
                compare_section(comparison, name, entry, witness.tables)
        elif chapter not in witness.chapters:  # that of a document of the other kind
            comparison.unknown.append((document.place("chapter"), chapter))
    for document in printed:
        compare = witness.chapters.get(document.data["chapter"])
        if compare:
            comparison.document = document
            compare(comparison)
    return comparison

"""Comparison with the sections of commands: heading, table and text, and mentions in other sections.

A section states the bytes, sign, unit and range of the numbers of its command, the bits of a status, and
replies in ASCII: single characters are values of an enumeration, longer ones are texts. A fact in the
registry that the document does not state is also a difference.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.lint.witness.reading import amount, count, find_field, limit, squash
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.model_fields import Enumeration, EnumValue, Field, FlagBit
from stagewire_generator.strict_yaml import KeyPath


def compare_numbers(section: Section) -> None:
    """Compare every sentence on the format of a number, and every range."""
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
    """Return the field of a sentence: the only field, or the field that it names."""
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
        same(f"{place}/signed", (*path, "sign"), words.signed(row["sign"]), _sign_of(field))
    if "unit" in row:
        same(f"{place}/unit", (*path, "unit"), words.unit(row["unit"]), _unit_of(field))


def _range(section: Section, field: Field, row: Json, path: KeyPath) -> None:
    place = _place("range", section, field)
    for key, bound in (("from", "minimum"), ("to", "maximum")):
        printed, encoded = limit(row[key], field), getattr(field, bound)
        section.comparison.same(f"{place}/{bound}", (*path, key), printed, encoded)


def _sign_of(field: Field) -> str:
    return "signed" if field.format.signed else "unsigned"


def _unit_of(field: Field) -> str:
    """Return the value of one count with its unit."""
    factor = field.quantity.factor if field.quantity else None
    return amount(1 / factor.counts_per_unit, field.unit or "") if factor else "no unit"


def _not_told(section: Section, field: Field, told: set[str]) -> None:
    """Report facts on a number that the registry has and the document does not state."""
    differs, place = section.comparison.differs, _place("format", section, field)
    number = field.format.kind == "integer" and field.role == "value"
    if number and field.format.size > 1 and "sign" not in told:
        differs(f"{place}/signed", section.path, NOTHING, _sign_of(field))
    if field.quantity and "unit" not in told:
        differs(f"{place}/unit", section.path, NOTHING, _unit_of(field))
    if field.ranged and "range" not in told:
        for bound in ("minimum", "maximum"):
            encoded = getattr(field, bound)
            if encoded != getattr(field.format, bound):
                place = _place("range", section, field)
                differs(f"{place}/{bound}", section.path, NOTHING, encoded)


def compare_bits(section: Section) -> None:
    """Compare a table of bits with the names of the bits."""
    tables = [field.flags for field in section.fields if field.flags][:1]
    known = {str(bit.bit): bit for table in tables for bit in table.bits}
    rows = section.rows("bits")
    if rows:
        section.comparison.tables |= {f"flags/{table.name}/bits/*/bit" for table in tables}
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
    """Compare a bit: its name must describe its meaning when it is set, not when it is clear."""
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
    """Whether a text has all words of a name, and no word for a clear bit."""
    words = _words(text)
    return words.issuperset(name) and not words & cleared


def _words(text: str) -> set[str]:
    """Return the words of a text, each also without a plural s."""
    words = re.findall(r"[a-z0-9]+", text.lower())
    return {*words, *(word.removesuffix("s") for word in words)}


_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def compare_replies(section: Section) -> None:
    """Compare every reply that is printed as text, and find values without one."""
    enum = _characters(section)
    values = {value.value: value for value in enum.values} if enum else {}
    if enum:
        section.comparison.tables.add(f"enumerations/{enum.name}/values/*/value")
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


def _characters(section: Section) -> Enumeration | None:
    """Return the values of a reply of one byte, which are characters."""
    fields = next((x.fields for x in section.command.layouts if x.form == "reply"), ())
    return fields[0].enum if len(fields) == 1 else None


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
    """Compare a text with the length of the reply and the descriptions of its bytes."""
    place, text = f"reply/{section.command.name}", row["text"]
    section.comparison.same(f"{place}/length", path, len(text), section.length("reply"))
    for ordinal in row.get("spaces", []):
        number = _ORDINALS.index(ordinal) if ordinal in _ORDINALS else len(text)
        section.comparison.same(f"{place}/{ordinal}", path, " ", text[number : number + 1])


def compare_commands(comparison: Comparison) -> None:
    """Compare the section of every command, and every mention of a command."""
    data = comparison.document.data
    for index, entry in enumerate(data["commands"]):
        path: KeyPath = ("commands", index)
        command = _headed(comparison, entry)
        if command is None:
            comparison.unknown.append((comparison.document.place(*path), entry["title"]))
            continue
        comparison.witnessed.add(command.name)
        section = Section(comparison, command, entry, path)
        _heading(section)
        _statements(section)
        _firmware(section)
        compare_numbers(section)
        compare_bits(section)
        compare_replies(section)
        for row, at in section.rows("breakdowns"):
            _breakdown(section, row, at)
    for index, row in enumerate(data["mentions"]):
        _mention(comparison, row, ("mentions", index))


def _headed(comparison: Comparison, entry: Json) -> Message | None:
    """Find the command of a heading by its title, else by its number."""
    commands = commands_of(comparison.protocol)
    by_title = {command.title: command for command in commands}
    words = comparison.vocabulary
    by_byte = {words.written("headings", "dec", x.id): x for x in commands if x.id is not None}
    return by_title.get(entry["title"]) or by_byte.get(entry["dec"][1])


def _heading(section: Section) -> None:
    """Compare the heading, the number of the section, and the table."""
    comparison, command, path = section.comparison, section.command, section.path
    words = comparison.vocabulary
    assert command.id is not None
    place, title = f"command/{command.name}", section.entry["title"]
    comparison.same(f"{place}/title", (*path, "title"), title, command.title)
    sections = dict(enumerate(comparison.protocol.document.get("sections", []), 1))
    encoded = sections.get(command.pages[0], f"no section {command.pages[0]}")
    comparison.same(f"{place}/page", (*path, "title"), title, encoded)
    for key, encoded in (
        ("dec", words.written("headings", "dec", command.id)),
        ("hex", words.written("headings", "hex", command.id)),
        ("keyboard", command.keyboard),
        ("size", words.no_size if command.size is None else str(command.size)),
    ):
        comparison.same(f"{place}/{key}", (*path, key), section.entry[key][1], encoded)


def _statements(section: Section) -> None:
    """Compare the statements on data, reply and size slot, and on dummies."""
    comparison, entry, path = section.comparison, section.entry, section.path
    name, size = section.command.name, section.command.size
    if "no_data" in entry:
        length = section.length("request")
        comparison.same(f"request/{name}/length", (*path, "no_data"), 0, length)
    if "no_reply" in entry:
        length = section.length("reply")
        comparison.same(f"reply/{name}/length", (*path, "no_reply"), 0, length)
    elif not section.length("reply"):  # the document states it for other commands
        comparison.differs(f"reply/{name}/length", path, NOTHING, 0)
    if "size_omitted" in entry:
        at = (*path, "size_omitted")
        comparison.same(f"size/{name}/omitted", at, "omitted", "omitted" if size is None else size)
    if "size_optional" in entry:  # only possible without data
        at = (*path, "size_optional")
        comparison.same(f"size/{name}/optional", at, 0, section.length("request"))
    comparison.same(f"dummy/{name}", path, "dummy" in entry, section.command.dummy)


def _firmware(section: Section) -> None:
    """Compare the versions in the section with those of facts that refer to the section."""
    protocol, page = section.comparison.protocol, section.command.pages[0]
    printed = {version for _, version in section.entry.get("firmware", [])}
    known = {
        fact.version
        for message in commands_of(protocol)
        for fact in message.firmware
        if (fact.page or message.pages[0]) == page
    }
    known |= {fact.version for fact in protocol.firmware if fact.page == page}
    section.comparison.members(f"firmware/{section.command.name}", section.path, printed, known)


def _breakdown(section: Section, row: Json, path: KeyPath) -> None:
    """Compare the sentence that explains the numbers of an example."""
    comparison, command = section.comparison, section.command
    place = f"breakdown/{command.name}"
    word = comparison.vocabulary.axis
    axes = {squash(x.name + word): str(x.value) for x in axes_of(comparison.protocol)}
    axis = axes.get(squash(row["axis_name"]), "no such axis")
    comparison.same(f"{place}/axis", (*path, "axis"), row["axis"], axis)
    comparison.same(f"{place}/command", (*path, "command"), row["command"], str(command.id))
    _same_title(comparison, f"{place}/name", (*path, "name"), row["name"], command)
    for key, encoded in (
        ("size", command.size),
        ("returns", section.length("reply")),
        ("reads", section.length("request")),
    ):
        if key in row:
            comparison.same(f"{place}/{key}", (*path, key), count(row[key]), encoded)
    end = str(comparison.protocol.framing["terminator"])
    comparison.same(f"{place}/end", (*path, "end"), row["end"], end)


def _same_title(
    comparison: Comparison, place: str, path: KeyPath, printed: str, command: Message
) -> None:
    """Compare a name with a title, ignoring case and punctuation."""
    if squash(printed) == squash(_short(command)):
        comparison.compared += 1
    else:
        comparison.differs(place, path, printed, _short(command))


def _short(command: Message) -> str:
    """Return the title of a command without a part in brackets, as the text uses it."""
    return re.sub(r" \(.*\)", "", command.title)


def _mention(comparison: Comparison, row: Json, path: KeyPath) -> None:
    """Compare number, name and key in a mention of a command with each other."""
    commands = commands_of(comparison.protocol)
    by_key = {str(command.id): command for command in commands}
    by_key |= {squash(_short(command)): command for command in commands}
    wanted = row.get("dec") or squash(row.get("name", ""))
    command = by_key.get(wanted)
    if command is None:
        unknown = row["name"] if "name" in row else row["dec"]
        comparison.unknown.append((comparison.document.place(*path), unknown))
        return
    comparison.compared += 1
    place = f"mention/{command.name}"
    if "name" in row:
        _same_title(comparison, f"{place}/name", (*path, "name"), row["name"], command)
    if "keyboard" in row:
        comparison.same(f"{place}/keyboard", (*path, "keyboard"), row["keyboard"], command.keyboard)


class Section(NamedTuple):
    """The printed section of a command, the command, and the comparison.

    :param path: the path of ``entry`` in the file of the witness.
    """

    comparison: Comparison
    command: Message
    entry: Json
    path: KeyPath

    def length(self, form: str) -> int:
        """Return the length of the request or the reply."""
        return next((x.length for x in self.command.layouts if x.form == form), 0)

    @property
    def fields(self) -> list[Field]:
        """The fields of the request and the reply."""
        return [field for layout in self.command.layouts for field in layout.fields]

    def rows(self, key: str) -> list[tuple[Json, KeyPath]]:
        """Return the rows of a list of the section, each with its path."""
        rows = self.entry.get(key, [])
        return [(row, (*self.path, key, index)) for index, row in enumerate(rows)]


def axes_of(protocol: Protocol) -> tuple[EnumValue, ...]:
    """Return the axis identifiers; empty if the enumeration is missing, which another check reports."""
    name = protocol.framing["axes"]
    return next((table.values for table in protocol.enumerations if table.name == name), ())


def commands_of(protocol: Protocol, kind: str = "command") -> list[Message]:
    """Return the commands of a kind: ``command``, or ``setup``."""
    return [message for message in protocol.messages if message.kind == kind]

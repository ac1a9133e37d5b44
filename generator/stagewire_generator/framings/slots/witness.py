"""Comparison with the general chapters of a document of commands, and with its setup commands."""

from __future__ import annotations

import re

from stagewire_generator.framings.slots.witness_commands import (
    axes_of,
    commands_of,
    compare_commands,
)
from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.lint.witness.reading import count, squash
from stagewire_generator.lint.witness.witness import Witness
from stagewire_generator.model import Json, Message
from stagewire_generator.strict_yaml import KeyPath

_SLOTS = ("axis", "command", "size", "data", "end")  # of a command, in order
_SLOTS_BEFORE_DATA = 3
_NUMBER = re.compile(r"[0-9]+")
_SETUP_LENGTH = 2  # the prefix and a byte
_SETUP_COLUMNS = ("dec", "hex", "keyboard", "post_byte")


def compare_document(comparison: Comparison) -> None:
    """Compare the title, revision and date of the document, and the titles of its sections."""
    data, document = comparison.document.data, comparison.protocol.document
    comparison.same("document/title", ("title",), data["title"][1], document["title"])
    revision = data["link"][1].rpartition("=")[2]
    comparison.same("document/issue", ("link",), revision, document["issue"])
    comparison.same("document/date", ("updated",), data["updated"][1], document["date"])
    sections = dict(enumerate(document.get("sections", []), 1))
    printed = {number: title for number, (_, title) in enumerate(data["sections"], 1)}
    printed |= {
        command.pages[0]: command.title
        for command in commands_of(comparison.protocol)
        if command.overlay
        == comparison.document.overlay  # others refer to pages of another document
    }
    for number in sorted(printed.keys() | sections.keys()):
        sides = (squash(titles.get(number, NOTHING)) for titles in (printed, sections))
        comparison.same(f"section/{number}", ("sections",), *sides)


def compare_setup(comparison: Comparison) -> None:
    """Compare the prefix, the length and every table of setup commands, and find missing commands."""
    data = comparison.document.data
    prefix = str(comparison.protocol.framing["prefix"])
    comparison.same("frame/prefix", ("prefix",), data["prefix"][1], prefix)
    comparison.same("setup/length", ("length",), count(data["length"][1]), _SETUP_LENGTH)
    for index, table in enumerate(data["tables"]):
        where = "setup" if index == 0 else f"setup{index + 1}"
        listed = set()
        for number, row in enumerate(table["rows"]):
            path: KeyPath = ("tables", index, "rows", number)
            command = _setup_command(comparison, row)
            if command is None:
                comparison.unknown.append((comparison.document.place(*path), row["says"]))
                continue
            listed.add(command.name)
            _setup_row(comparison, f"{where}/{command.name}", command, row, path)
        comparison.witnessed |= listed
        for command in commands_of(comparison.protocol, "setup"):
            if command.name not in listed:
                place = f"{where}/{command.name}/missing"
                comparison.differs(place, ("tables", index, "rows"), NOTHING, command.name)


def _setup_command(comparison: Comparison, row: Json) -> Message | None:
    """Find the command of a row by its description, else by its bytes."""
    commands = commands_of(comparison.protocol, "setup")
    by_title = {_plain(command.title): command for command in commands}
    key = "dec" if "dec" in row else "hex"
    by_bytes = {_bytes(comparison, command)[key]: command for command in commands}
    return by_title.get(_plain(row["says"])) or by_bytes.get(row[key])


def _bytes(comparison: Comparison, command: Message) -> dict[str, str]:
    """Return the bytes of a setup command as the document prints them, and its keyboard form."""
    assert command.id is not None
    words, prefix = comparison.vocabulary, comparison.protocol.framing["prefix"]
    return {
        column: words.written("setup", column, command.id, prefix, command.keyboard)
        for column in _SETUP_COLUMNS
    }


def _setup_row(
    comparison: Comparison, place: str, command: Message, row: Json, path: KeyPath
) -> None:
    comparison.same(f"{place}/title", path, _plain(row["says"]), _plain(command.title))
    for key, encoded in _bytes(comparison, command).items():
        if key in row:
            comparison.same(f"{place}/{key}", (*path, key), row[key], encoded)


def _plain(text: str) -> str:
    return text.rstrip(". ")


def compare_format(comparison: Comparison) -> None:
    """Compare slots, sizes, exceptions, axis identifiers, the terminator and firmware versions."""
    data = comparison.document.data
    terminator = chr(comparison.protocol.framing["terminator"])
    for index, (_, sign) in enumerate(data["terminator"]):
        comparison.same("frame/terminator", ("terminator", index), sign, terminator)
    _slots(comparison, data)
    _sizes(comparison, data["sizes"])
    _exceptions(comparison, data["exceptions"])
    _axes(comparison, data["axes"])
    pages = {command.pages[0] for command in commands_of(comparison.protocol)}
    printed = {version for _, version in data.get("firmware", [])}
    known = {fact.version for fact in comparison.protocol.firmware if fact.page not in pages}
    comparison.members("firmware", ("firmware",), printed, known)


def _slots(comparison: Comparison, data: Json) -> None:
    """Compare the order of the slots, printed as bytes and as groups, and the last byte of the data."""
    for key in ("bytes", "groups"):
        comparison.same(f"frame/{key}", (key,), len(data[key]), len(_SLOTS))
        for index, ((_, label, says), slot) in enumerate(zip(data[key], _SLOTS, strict=False)):
            place, path = f"frame/{key}/{slot}", (key, index)
            word = comparison.vocabulary.slots[slot]
            named = word.lower() in f"{label} {says}".lower()
            comparison.same(place, path, named, True)
            number = _NUMBER.search(label)  # the last byte has none
            if number or slot != "end":
                printed = number[0] if number else NOTHING
                comparison.same(f"{place}/number", path, printed, str(index + 1))
    for index, (_, label, _) in enumerate(data["bytes"][_SLOTS_BEFORE_DATA:][:1]):
        last = str(_SLOTS_BEFORE_DATA + max(_sizes_in_use(comparison)))
        path = ("bytes", _SLOTS_BEFORE_DATA + index)
        comparison.same("frame/bytes/last", path, label.rpartition("-")[2], last)


def _sizes_in_use(comparison: Comparison) -> list[int]:
    return [command.size or 0 for command in commands_of(comparison.protocol)] or [0]


def _sizes(comparison: Comparison, rows: list[Json]) -> None:
    """Compare every range of sizes: of the slot, or of all commands."""
    sizes = _sizes_in_use(comparison)
    used, slot = (min(sizes), max(sizes)), (0, comparison.protocol.framing["maximum_length"])
    for index, row in enumerate(rows):
        limits = slot if comparison.vocabulary.whole_slot in row["of"] else used
        for key, encoded in zip(("from", "to"), limits, strict=True):
            place = f"size/{squash(row['of'])}/{key}"
            comparison.same(place, ("sizes", index, key), row[key], str(encoded))


def _exceptions(comparison: Comparison, rows: list[Json]) -> None:
    """Compare the number and the names of the commands without a size slot."""
    commands = commands_of(comparison.protocol)
    omitting = {command.name for command in commands if command.size is None}
    by_key = {command.keyboard: command.name for command in commands}
    for index, row in enumerate(rows):
        path: KeyPath = ("exceptions", index)
        comparison.same("exceptions/count", path, count(row["count"]), len(omitting))
        if "commands" in row:
            named = {by_key.get(key, f"key-{ord(key[:1] or '-')}") for key, _ in row["commands"]}
            comparison.members("exceptions", (*path, "commands"), named, omitting)


def _axes(comparison: Comparison, rows: list[Json]) -> None:
    """Compare the number, the key and the state of every axis identifier."""
    words = comparison.vocabulary
    known = {squash(axis.name): axis for axis in axes_of(comparison.protocol)}
    for index, row in enumerate(rows):
        path: KeyPath = ("axes", index)
        axis = known.pop(squash(row["name"]).removesuffix(squash(words.axis)), None)
        if axis is None:
            comparison.differs(f"axis/{squash(row['name'])}", path, row["name"], NOTHING)
            continue
        place = f"axis/{axis.name}"
        for key in ("dec", "hex"):
            encoded = words.written("axes", key, axis.value)
            comparison.same(f"{place}/{key}", (*path, key), row[key], encoded)
        comparison.same(f"{place}/keyboard", (*path, "keyboard"), row["keyboard"], axis.keyboard)
        comparison.same(f"{place}/reserved", path, row.get("reserved", False), axis.reserved)
    for axis in known.values():
        comparison.differs(f"axis/{axis.name}/missing", ("axes",), NOTHING, axis.name)
    table = f"enumerations/{comparison.protocol.framing['axes']}/values/*"
    comparison.tables |= {f"{table}/{key}" for key in ("value", "keyboard", "reserved")}


def compare_wording(comparison: Comparison) -> None:
    """Record the words that only people can compare: each subject needs an erratum."""
    for subject in comparison.document.data["words"]:
        place = comparison.document.place("words", subject)
        comparison.not_compared[f"wording/{subject}"] = place


WITNESS = Witness(
    {
        "document": compare_document,
        "setup": compare_setup,
        "format": compare_format,
        "commands": compare_commands,
        "wording": compare_wording,
    }
)

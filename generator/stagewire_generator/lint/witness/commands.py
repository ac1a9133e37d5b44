"""The sections of commands: heading, table and text of each, and where it is named in passing."""

from __future__ import annotations

import re

from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.lint.witness.numbers import compare_bits, compare_numbers
from stagewire_generator.lint.witness.reading import count, squash
from stagewire_generator.lint.witness.replies import compare_replies
from stagewire_generator.lint.witness.section import Section, axes_of, commands_of
from stagewire_generator.model import Json, Message
from stagewire_generator.strict_yaml import KeyPath

__all__ = ["compare_commands"]


def compare_commands(comparison: Comparison) -> None:
    """Compare the section of every command, and every mention of one."""
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
    """Find the command that a heading means: by its title, else by its number."""
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
    """Compare what is said of data, reply and size slot, and whether it is a dummy."""
    comparison, entry, path = section.comparison, section.entry, section.path
    name, size = section.command.name, section.command.size
    if "no_data" in entry:
        length = section.length("request")
        comparison.same(f"request/{name}/length", (*path, "no_data"), 0, length)
    if "no_reply" in entry:
        length = section.length("reply")
        comparison.same(f"reply/{name}/length", (*path, "no_reply"), 0, length)
    elif not section.length("reply"):  # the document says so of other commands
        comparison.differs(f"reply/{name}/length", path, NOTHING, 0)
    if "size_omitted" in entry:
        at = (*path, "size_omitted")
        comparison.same(f"size/{name}/omitted", at, "omitted", "omitted" if size is None else size)
    if "size_optional" in entry:  # that is so where there are no data
        at = (*path, "size_optional")
        comparison.same(f"size/{name}/optional", at, 0, section.length("request"))
    comparison.same(f"dummy/{name}", path, "dummy" in entry, section.command.dummy)


def _firmware(section: Section) -> None:
    """Compare the versions that the section names with those of facts that refer to the section."""
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
    """Compare the sentence that says what the numbers of an example are."""
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
    """Compare a name with a title, but for case and signs."""
    if squash(printed) == squash(_short(command)):
        comparison.compared += 1
    else:
        comparison.differs(place, path, printed, _short(command))


def _short(command: Message) -> str:
    """Return the title of a command without what it has in brackets, as the text names it."""
    return re.sub(r" \(.*\)", "", command.title)


def _mention(comparison: Comparison, row: Json, path: KeyPath) -> None:
    """Compare number, name and key of a command that is named in passing with each other."""
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

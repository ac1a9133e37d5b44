"""Parsers for the document that describes commands one by one, each under a heading with a table.

They depend on the wording of the document but not on the protocol, and they never read our transcription.
Their results have the same form as the witness, so the two can be compared directly.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from .text import Document

Data = dict[str, Any]
Printed = list[Any]  # line and text

HEADING = re.compile(r"Command: ([A-Z].*)")
ROWS = {"dec": "Dec", "hex": "Hex", "keyboard": "Keyboard", "size": "Data Size"}
STATEMENT = re.compile(r"Requests|Instructs")
BYTES = re.compile(r"\b(\d|one|two|three)[ -](?:8-bit )?bytes?\b")
SIGN = re.compile(r"two's compl[ie]ment|\bsigned\b|straight|divided down")
UNIT = re.compile(r"tenths of (?:a micron|microns)|milliseconds|\$\\mu\\text\{m/s\}\$|μ m/s")
RANGE = re.compile(r"(?:between|from) (?P<from>\d+) (?:and|to) (?P<to>\d+)")
BIT = re.compile(r"Bit (?P<bit>\d)\t(?:(?P<of>[^=]+): )?0 = (?P<zero>.+), 1 = (?P<one>.+)")
FIXED_BIT = re.compile(r"Bit (?P<bit>\d)\tAlways (?P<always>\d), as (?P<because>.+)")
REPLIES = (
    re.compile(r"(?:upper|lower) case (?P<text>\w)"),
    re.compile(
        r"reply (?P<dec>\d+) is .* character (?P<text>\w), which .* currently (?P<means>busy)"
    ),
    re.compile(r"The (?P<text>\w) is the controller's response, which .* (?P<means>not busy)"),
    re.compile(r"(?P<means>not busy) '(?P<text>\w)'"),
    re.compile(r"(?P<text>EMOT :)"),
)
SPACES = re.compile(r"The (\w+) and (\w+) bytes are spaces")
BREAKDOWN = {
    "axis": r"[Tt]he (\d+) represents the \w+ axis",
    "axis_name": r"\d+ represents the (\w+ axis)",
    "command": r"axis, the (\d+) represents",
    "name": r"axis, the \d+ represents the (.+?) command",
    "size": r"[Tt]he (?:data size is )?(\d+) (?:means|and can)",
    "returns": r"should return (\w+) bytes?",
    "reads": r"should read (\w+) bytes?",
    "end": r"[Tt]he (\d+) is the (?:colon|end)",
}
NO_DATA = re.compile(r"not give or receive data|no data or response")
NO_REPLY = re.compile(r"not give or receive data|no data or response|There is no re|No reply")
FLAGS = {
    "size_omitted": re.compile(r"data field is omitted"),
    "size_optional": re.compile(r"either be included or left off"),
    "dummy": re.compile(r"Dummy function"),
}
FIRMWARE = re.compile(r"firmware version (\d+\.\d+)")
MENTIONS = (
    re.compile(r"first command, (?P<name>.+?),"),
    re.compile(r"The (?P<keyboard>\S) stands for the command (?P<name>.+?) and"),
    re.compile(r"in the (?P<name>(?:[A-Z]\w+ )+)Command"),
    re.compile(r"command (?P<dec>\d+)(?: \((?P<name>.+?)\))?"),
    re.compile(r"(?P<dec>\d+) commands to"),
    re.compile(r"(?P<name>[A-Z]\w+(?:-[A-Z]\w+)+)"),
)
AXIS = re.compile(
    r"(?P<name>.+?):?\tDec: ?(?P<dec>\d+) ?\(Hex: (?P<hex>\w+)\)\tKeyboard: (?P<keyboard>\S+)"
)
SETUP = (
    re.compile(
        r"(?P<dec>\d+ \d+) (?P<keyboard>Alt\S+ '.')\t(?P<says>.+?)(?: for High Level .*)?"
        r'(?: \(Note: .* "(?P<post_byte>.)" must .*)?'
    ),
    re.compile(r"(?P<hex>#\w+#\w+)\t(?P<says>.+?)(?: for High Level .*)?"),
)
SIZES = re.compile(
    r"(?P<of>data|range of this variable|supports) (?:represented in |is from )?"
    r"(?P<from>\d+) to (?P<to>\d+)"
)


@dataclass(frozen=True)
class Paragraph:
    """Joined lines of a sentence that continues after empty lines, with the start of each line."""

    line: int
    text: str
    starts: tuple[tuple[int, int], ...]  # offset in the text, line

    def line_at(self, offset: int) -> int:
        return max(line for start, line in self.starts if start <= offset)


def paragraphs(document: Document, first: int, last: int) -> Iterator[Paragraph]:
    """Join a long line without a full stop to the next line if that begins in lower case."""
    text, starts = "", []
    lines = [line for line in range(first, last + 1) if document[line].strip()]
    for line, following in zip_longest(lines, lines[1:]):
        starts.append((len(text), line))
        text += document[line].strip()
        broken = len(document[line]) > 60 and re.search(r"[\w']$", document[line])
        if broken and following and re.match(r"(?!\w+ =)[a-z0-9]", document[following]):
            text += " "
            continue
        yield Paragraph(starts[0][1], text, tuple(starts))
        text, starts = "", []


def given(line: int, match: re.Match[str]) -> Data:
    """Return the line and the groups of a match."""
    groups = match.groupdict().items()
    return {"line": line, **{key: text.strip() for key, text in groups if text is not None}}


def sections(document: Document) -> list[tuple[int, str, int]]:
    """Return first line, heading and last line of the section of every command."""
    found = [
        (line, match[1])
        for line in document.numbers()
        if (match := HEADING.fullmatch(document[line]))
    ]
    ends = [line - 1 for line, _ in found[1:]] + [document.numbers()[-1]]
    return [(line, title, end) for (line, title), end in zip(found, ends, strict=True)]


def commands(document: Document) -> list[Data]:
    """Return the contents of the section of each command."""
    found = [_command(document, *section) for section in sections(document)]
    # A reply belongs to the command that the sentence names, in whichever section the sentence is
    status = next(entry for entry in found if entry["title"] == "Read Status")
    for entry in found:
        if entry is not status and any("means" in reply for reply in entry.get("replies", [])):
            status["replies"] += entry.pop("replies")
    return found


def _command(document: Document, line: int, title: str, end: int) -> Data:
    entry: Data = {"title": title, "line": line}
    for number, (key, label) in enumerate(ROWS.items(), line + 2):
        row = re.fullmatch(rf"{label}\t(.*)", document[number])
        entry[key] = [number, row[1] if row else None]
    lists: Data = {}
    for part in paragraphs(document, line + 6, end):
        _paragraph(part, entry, lists)
    return entry | {key: rows for key, rows in lists.items() if rows}


def _paragraph(part: Paragraph, entry: Data, lists: Data) -> None:
    number = {
        key: match[pattern.groups]
        for key, pattern in (("bytes", BYTES), ("sign", SIGN), ("unit", UNIT))
        if (match := pattern.search(part.text))
    }
    if STATEMENT.match(part.text) and number:
        several = re.search(r"current (.+?) in .* followed by", part.text)
        of = {"of": several[1]} if several else {}
        lists.setdefault("formats", []).append({"line": part.line, **of, **number})
    breakdown = {
        key: match[1]
        for key, pattern in BREAKDOWN.items()
        if (match := re.search(pattern, part.text))
    }
    if "axis" in breakdown:
        lists.setdefault("breakdowns", []).append({"line": part.line, **breakdown})
    for key, patterns in (("ranges", [RANGE]), ("bits", [BIT, FIXED_BIT]), ("replies", REPLIES)):
        rows = [(m.start(), m) for pattern in patterns for m in pattern.finditer(part.text)]
        for start, match in sorted(rows, key=lambda row: row[0]):
            lists.setdefault(key, []).append(given(part.line_at(start), match))
    if spaces := SPACES.search(part.text):
        lists["replies"][-1]["spaces"] = list(spaces.groups())
    for match in FIRMWARE.finditer(part.text):
        lists.setdefault("firmware", []).append([part.line_at(match.start()), match[1]])
    for key, pattern in (("no_data", NO_DATA), ("no_reply", NO_REPLY)):
        if pattern.search(part.text):
            lists.setdefault(key, []).append(part.line)
    entry.update({key: part.line for key, pattern in FLAGS.items() if pattern.search(part.text)})


def mentions(document: Document) -> list[Data]:
    """Return the commands that are mentioned in other places."""
    found = []
    for line in document.numbers():
        rows = [m for pattern in MENTIONS for m in pattern.finditer(document[line])]
        found += [given(line, match) for match in sorted(rows, key=lambda m: m.start())]
    return found


def format_chapter(document: Document) -> Data:
    """Return the statements of the document about the form of all commands."""
    end = sections(document)[0][0] - 1
    parts = list(paragraphs(document, 1, end))
    reserved = next(part.line for part in parts if "reserved for future use" in part.text)
    found: Data = {"chapter": "format", "firmware": [], "sizes": [], "axes": [], "terminator": []}
    for part in parts:
        for match in FIRMWARE.finditer(part.text):
            found["firmware"].append([part.line_at(match.start()), match[1]])
        for match in SIZES.finditer(part.text):
            found["sizes"].append(given(part.line_at(match.start()), match))
        if re.search(r"\(:\)|':'", part.text):
            found["terminator"].append([part.line, ":"])
        if match := AXIS.fullmatch(part.text):
            mark = {"reserved": True} if part.line > reserved else {}
            found["axes"].append({**given(part.line, match), **mark})
    found["bytes"] = _labelled(
        parts, r"((?:LAST )?BYTES?(?: ?\d[-\d]*)?): (.+?)(?:,.*| flags .*| to be .*)?"
    )
    found["groups"] = _labelled(parts, r"(Group \d(?: / Bytes? \S+)?): (.+?) This .*")
    found["exceptions"] = list(_exceptions(parts))
    return found


def _labelled(parts: list[Paragraph], pattern: str) -> list[Printed]:
    rows = ((part.line, re.fullmatch(pattern, part.text)) for part in parts)
    return [[line, *match.groups()] for line, match in rows if match]


def _exceptions(parts: list[Paragraph]) -> Iterator[Data]:
    for part in parts:
        if match := re.search(r"In (\w+) special cases|There are (\d+) commands that", part.text):
            entry: Data = {"line": part.line, "count": match[1] or match[2]}
            if named := re.findall(r"'(.)'-(.+?)[,.]", part.text):
                entry["commands"] = [list(pair) for pair in named]
            yield entry


def setup_chapter(document: Document) -> Data:
    """Return prefix, length and tables of the setup commands."""
    found: Data = {"chapter": "setup", "tables": []}
    for line in range(1, sections(document)[0][0]):
        if match := re.search(
            r"these (\w+) byte commands by their prefix byte (\d+)", document[line]
        ):
            found |= {"length": [line, match[1]], "prefix": [line, match[2]]}
        if re.match(r"For [A-Z]", document[line]):
            found["tables"].append({"title": document[line], "line": line, "rows": []})
        for pattern in SETUP:
            if match := pattern.fullmatch(document[line]):
                found["tables"][-1]["rows"].append(given(line, match))
    return found


def document_chapter(document: Document) -> Data:
    """Return title, headings in capitals, address and date of the document."""
    found: Data = {"chapter": "document", "title": [1, document[1]], "sections": []}
    for line in document.numbers():
        if re.fullmatch(r"[A-Z]+( [A-Z]+)+", document[line]):
            found["sections"].append([line, document[line]])
        if match := re.match(r"Permanent link: (\S+)", document[line]):
            found["link"] = [line, match[1]]
        if match := re.match(r"Last update: \*\*(.+)\*\*", document[line]):
            found["updated"] = [line, match[1]]
    return found

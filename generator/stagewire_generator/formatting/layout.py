"""Convert a tree to the lines of a file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

from stagewire_generator.formatting.tree import BLANK, Collection, Entry, Node, Scalar

_LONGEST = 140
"""Maximum length of a line, without a comment at its end."""
_FILLED = 120
"""Maximum length of the lines in a rewrapped text or list."""
_STEP = 2
_GAP = re.compile(r"(?<=\S) (?=\S)")


@dataclass(slots=True)
class _Piece:
    """A printed entry: the comments above it, and its lines."""

    above: list[str]
    lines: list[str]


def lay_out(root: Collection, header: list[str]) -> list[str]:
    """Return the lines of a file.

    :param header: comments and blank lines about the file, above its first entry.
    """
    return _joined([_Piece(header, []), *_entries(root, 0)], root.tail, 0)


def _joined(pieces: Iterable[_Piece], tail: list[str], indent: int) -> list[str]:
    """Return the lines of a block, without a blank line at the beginning or two in a row."""
    lines: list[str] = []
    for piece in pieces:
        lines += _loose(piece.above, indent, first=not lines)
        lines += piece.lines
    return lines + _loose(tail, indent)


def _loose(comments: Iterable[str], indent: int, *, first: bool = False) -> list[str]:
    lines: list[str] = []
    for comment in comments:
        if comment:
            lines.append(f"{'':{indent}}{comment}")
        elif lines[-1:] != [BLANK] and (lines or not first):
            lines.append(BLANK)
    return lines


def _entries(collection: Collection, indent: int) -> Iterator[_Piece]:
    for entry in collection.entries:
        yield _keyed(entry, indent) if collection.mapping else _item(entry, indent)


def _keyed(entry: Entry, indent: int) -> _Piece:
    assert entry.key is not None  # entries of a mapping have keys
    lead = f"{'':{indent}}{entry.key.source}:"
    if (short := _short(entry, lead, indent)) is not None:
        return _Piece(entry.before, short)
    assert isinstance(entry.value, Collection)  # every scalar has a short form
    lines = _broken(entry.value, indent + _STEP)
    if lines is None:
        lines = _joined(_entries(entry.value, indent + _STEP), entry.value.tail, indent + _STEP)
    return _Piece(entry.before, [_with(lead, entry.after), *lines])


def _item(entry: Entry, indent: int) -> _Piece:
    lead = f"{'':{indent}}-"
    if (short := _short(entry, lead, indent)) is not None:
        return _Piece(entry.before, short)
    assert isinstance(entry.value, Collection)  # every scalar has a short form
    inner = indent + _STEP
    above = [*entry.before, entry.after] if entry.after else entry.before
    lines = _broken(entry.value, inner)
    if lines is None:
        pieces = list(_entries(entry.value, inner))
        above = [*above, *filter(None, pieces[0].above)]  # no comment fits after the dash
        pieces[0].above = []
        lines = _joined(pieces, entry.value.tail, inner)
    return _Piece(above, [f"{lead} {lines[0][inner:]}", *lines[1:]])


def _with(line: str, comment: str) -> str:
    return f"{line}  {comment}" if comment else line


def _short(entry: Entry, lead: str, indent: int) -> list[str] | None:
    """Return an entry with its value on the same line, or its text below; None if neither is possible."""
    value = entry.value
    if isinstance(value, Collection):
        if not value.flow or value.commented:
            return None
        line = f"{lead} {_flow(value)}"
        together = value.entries[-1].line == entry.line if value.entries else True
        longest = _LONGEST if together or not _plain_list(value) else _FILLED
        return [_with(line, entry.after)] if len(line) <= longest else None
    if value.block:
        header, *lines = _block(value, indent + _STEP)
        return [_with(f"{lead} {header}", entry.after), *lines]
    line = f"{lead} {value.source}"
    if len(line) > _LONGEST and (lines := _folded(value.value, indent + _STEP)):
        return [_with(f"{lead} >-", entry.after), *lines]
    return [_with(line, entry.after)]


def _flow(node: Node) -> str:
    """Return a value on one line."""
    if isinstance(node, Scalar):
        return node.source
    inner = ", ".join(
        f"{entry.key.source}: {_flow(entry.value)}" if entry.key else _flow(entry.value)
        for entry in node.entries
    )
    return f"{{{inner}}}" if node.mapping else f"[{inner}]"


def _plain_list(node: Collection) -> bool:
    return not node.mapping and all(isinstance(entry.value, Scalar) for entry in node.entries)


def _rows(node: Collection) -> list[list[str]]:
    """Return the items of a list, grouped by their lines in the file."""
    rows = groupby(node.entries, key=lambda entry: entry.line)
    return [[_flow(entry.value) for entry in row] for _, row in rows]


def _broken(node: Collection, indent: int) -> list[str] | None:
    """Return a list of words or numbers in brackets over several lines, or None for any other value.

    Each line keeps its items, which often belong together, unless a line is too long.
    """
    if not node.flow or node.commented or not _plain_list(node):
        return None
    rows = _rows(node)
    if any(indent + len(", ".join(row)) + 2 > _LONGEST for row in rows):
        rows = _filled([item for row in rows for item in row], ", ", indent + 2)
    texts = [", ".join(row) for row in rows]
    lines = [f"{'':{indent}} {text}," for text in texts]
    lines[0] = f"{'':{indent}}[{texts[0]},"
    lines[-1] = f"{lines[-1][:-1]}]"
    return lines


def _filled(words: Iterable[str], separator: str, indent: int) -> list[list[str]]:
    """Return the words divided into lines, with as many on each line as fit."""
    rows: list[list[str]] = [[]]
    width = indent
    for word in words:
        if rows[-1] and width + len(word) > _FILLED:
            rows.append([])
            width = indent
        rows[-1].append(word)
        width += len(word) + len(separator)
    return rows


def _folded(text: str, indent: int) -> list[str]:
    """Return the lines of a text below ``>-``, or nothing if it cannot be written in this way."""
    if not text.isprintable() or text != text.strip() or not _GAP.search(text):
        return []
    return [f"{'':{indent}}{' '.join(row)}" for row in _filled(_GAP.split(text), " ", indent)]


def _block(scalar: Scalar, indent: int) -> list[str]:
    """Return the header of a block, which goes on the line of its key, and the lines below.

    The lines are kept, unless a line of a paragraph is too long.
    """
    header, *lines = scalar.source.split("\n")
    if next(filter(None, lines), "").startswith(" "):
        header = f"{header[0]}{_STEP}{header[1:]}"  # the first line does not show the indentation
    if header == ">-" and any(indent + len(line) > _LONGEST for line in lines):
        paragraph = all(line and not line.startswith(" ") for line in lines)
        if paragraph and (folded := _folded(scalar.value, indent)):
            return [header, *folded]
    return [header, *(f"{'':{indent}}{line}" if line else "" for line in lines)]

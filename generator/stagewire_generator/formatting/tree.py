"""The tree of a YAML file for the formatter: values, comments and blank lines.

ruamel.yaml parses the text and reports the position of every value. Between scalars there are only white
space, indicators and comments, so no comment is missed. (ruamel.yaml can keep comments itself, but not those
in brackets, nor one between a key and its value.)

A comment at the end of a line belongs to the entry before it. A comment on its own line belongs to the entry
below. But if it is indented further than that entry, it ends the mapping or list above that has the same
depth as the comment.

:mod:`.rules` changes a tree, and :mod:`.layout` writes it.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from ruamel.yaml import YAML
from ruamel.yaml.events import (
    CollectionEndEvent,
    Event,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

BLANK = ""
"""A blank line among comments."""


@dataclass(slots=True)
class Scalar:
    """A text, a number or a word; ``source`` is its spelling in the file.

    ``style`` is ``'"'``, ``"'"``, ``"|"`` or ``">"``, or empty for a plain scalar.
    """

    value: str
    source: str
    style: str = ""

    @property
    def block(self) -> bool:
        """Whether its lines are below a ``|`` or ``>``."""
        return self.style in ("|", ">")


@dataclass(slots=True)
class Entry:
    """A key with its value, or an item of a list (without a key), and its comments.

    :ivar before: comments on the lines above it, and blank lines.
    :ivar after: the comment at the end of its line.
    :ivar line: its first line in the file, counted from zero.
    """

    key: Scalar | None
    value: Node
    line: int
    before: list[str] = field(default_factory=list)
    after: str = ""


@dataclass(slots=True)
class Collection:
    """A mapping or a list.

    :ivar flow: whether it is in brackets.
    :ivar column: the column of its entries, counted from zero; for a block only.
    :ivar tail: comments after its last entry.
    """

    mapping: bool
    flow: bool
    column: int
    entries: list[Entry] = field(default_factory=list)
    tail: list[str] = field(default_factory=list)

    def scalars(self) -> Iterator[Scalar]:
        """Yield the scalars of a list, including those of nested lists."""
        for entry in self.entries:
            if isinstance(entry.value, Scalar):
                yield entry.value
            elif not entry.value.mapping:
                yield from entry.value.scalars()

    @property
    def commented(self) -> bool:
        """Whether it contains comments, which brackets on one line cannot hold."""
        return bool(self.tail) or any(
            entry.before
            or entry.after
            or (isinstance(entry.value, Collection) and entry.value.commented)
            for entry in self.entries
        )


Node = Scalar | Collection


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment, or a blank line (an empty ``text``), with its position in the file.

    :ivar start: index of its first character.
    :ivar column: its column, counted from zero.
    :ivar own_line: whether it is the only thing on its line.
    """

    start: int
    column: int
    own_line: bool
    text: str


@dataclass(frozen=True, slots=True)
class Anchor:
    """The beginning or end of something that comments can belong to.

    :ivar start: index of its first character.
    :ivar inside: the collections around it, outermost first.
    :ivar entry: the entry that begins here, whose value is here, or whose brackets close here.
    :ivar closed: the collection that ends here: the one in brackets, or the whole file.
    """

    start: int
    inside: tuple[Collection, ...]
    entry: Entry | None
    begins: bool = False
    closed: Collection | None = None

    @property
    def column(self) -> int:
        """The column of the entry that begins here in a block, or -1 for anything else."""
        return self.inside[-1].column if self.begins and not self.inside[-1].flow else -1

    def above(self) -> list[str]:
        """Return the list for comments above this position."""
        if self.closed is not None:
            return self.closed.tail
        assert self.entry is not None  # otherwise this is an entry or its value
        return self.entry.before

    def beside(self, text: str) -> None:
        """Add a comment at the end of the line; put any further comments above the entry."""
        if self.entry is None:
            self.above().append(text)
        elif self.entry.after:
            self.entry.before.append(text)
        else:
            self.entry.after = text


def attach(comments: Iterable[Comment], anchors: Sequence[Anchor]) -> None:
    """Attach each comment and blank line to the entry or collection that it belongs to.

    Both arguments are in the order of the file; the last anchor is the end of the file.
    """
    starts = [anchor.start for anchor in anchors]
    for index, group in groupby(comments, lambda comment: bisect_right(starts, comment.start)):
        _between(group, anchors[index - 1] if index else None, anchors[index])


def _between(comments: Iterable[Comment], before: Anchor | None, after: Anchor) -> None:
    """Attach the comments between two neighbouring anchors."""
    closed = [
        collection
        for collection in (before.inside if before else ())
        if not collection.flow and collection not in after.inside
    ]
    blank = False
    for comment in comments:
        if not comment.text:
            blank = after.column >= 0 or after.entry is None
        elif before is not None and not comment.own_line:
            before.beside(comment.text)
        else:
            closed = _around(comment, closed) if comment.column > after.column else []
            lines = closed[-1].tail if closed else after.above()
            if blank:
                lines.append(BLANK)
            lines.append(comment.text)
            blank = False
    if blank:
        after.above().append(BLANK)


def _around(comment: Comment, closed: list[Collection]) -> list[Collection]:
    """Return the collections above a comment that are not indented further than the comment.

    A list may begin in the column of its key; a comment in that column belongs to the outer collection.
    """
    fitting = [collection for collection in closed if collection.column <= comment.column]
    while len(fitting) > 1 and fitting[-2].column == fitting[-1].column:
        fitting.pop()
    return fitting


_HEADER = re.compile(r"([|>])([+-]?)([1-9]?)([+-]?)")  # of a block
_COMMENT = re.compile(r"#[^\n]*")
_LOOSE = re.compile(r"#[^\n]*|(?<=\n)[ \t]*(?=\n)")  # a comment, or a blank line


def read(text: str) -> Node:
    """Return the tree of a file, with its comments and blank lines.

    :param text: YAML that the strict loader accepts, with line feeds as line endings.
    Raises :class:`ruamel.yaml.error.YAMLError` if ruamel.yaml rejects it.
    """
    reader = _Reader(text)
    root = reader.document()
    if isinstance(root, Collection):
        reader.anchors.append(Anchor(len(text) + 1, (), None, closed=root))
        attach(_comments(text, reader.texts), reader.anchors)
    return root


def comments(text: str) -> list[str]:
    """Return the comments of a file in order."""
    reader = _Reader(text)
    reader.document()
    return [comment.text for comment in _comments(text, reader.texts) if comment.text]


def _comments(text: str, texts: list[tuple[int, int]]) -> Iterator[Comment]:
    """Yield the comments and blank lines of a file, which are between its scalars.

    :param texts: the beginning and end of each scalar, in the order of the file.
    """
    end = 0
    for begins, ends in [*texts, (len(text), len(text))]:
        for found in _LOOSE.finditer(text, end, begins):
            line = text.rfind("\n", 0, found.start()) + 1
            own_line = not text[line : found.start()].strip()
            yield Comment(found.start(), found.start() - line, own_line, found.group().strip())
        end = ends


def _has_place(event: Event) -> bool:
    """Whether a value has its own first character.

    A block begins with its first entry, and null may be written as an empty text.
    """
    if isinstance(event, MappingStartEvent | SequenceStartEvent):
        return bool(event.flow_style)
    return bool(event.end_mark.index > event.start_mark.index)


class _Reader:
    """Builds the tree from the events of the parser, and records the anchors for comments.

    :ivar texts: the beginning and end of each scalar.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.events: Iterator[Event] = YAML(typ="safe", pure=True).parse(text)
        self.anchors: list[Anchor] = []
        self.texts: list[tuple[int, int]] = []
        self.inside: tuple[Collection, ...] = ()

    def document(self) -> Node:
        event = next(self.events)
        while not isinstance(event, NodeEvent):  # the stream and the document begin
            event = next(self.events)
        node = self.node(event, None)
        while not isinstance(next(self.events), StreamEndEvent):
            pass
        return node

    def node(self, event: Event, entry: Entry | None) -> Node:
        if isinstance(event, ScalarEvent):
            return self.scalar(event)
        assert isinstance(event, MappingStartEvent | SequenceStartEvent)
        column = event.start_mark.column
        collection = Collection(isinstance(event, MappingStartEvent), event.flow_style, column)
        self.inside = (*self.inside, collection)
        while not isinstance(event := next(self.events), CollectionEndEvent):
            collection.entries.append(self.entry(event, collection))
        self.inside = self.inside[:-1]
        if collection.flow:
            start = event.start_mark.index
            closed = collection if collection.entries or entry is None else None
            self.anchors.append(Anchor(start, self.inside, entry, closed=closed))
        return collection

    def entry(self, event: Event, collection: Collection) -> Entry:
        start = event.start_mark.index
        if not collection.flow and not collection.mapping:
            start = self.dash(start)
        entry = Entry(None, Scalar("", ""), event.start_mark.line)
        self.anchors.append(Anchor(start, self.inside, entry, begins=True))
        if collection.mapping:
            assert isinstance(event, ScalarEvent)  # the strict loader rejects any other key
            entry.key = self.scalar(event)
            event = next(self.events)
            if _has_place(event):
                self.anchors.append(Anchor(event.start_mark.index, self.inside, entry))
        entry.value = self.node(event, entry)
        return entry

    def dash(self, start: int) -> int:
        """Return the position of the dash for the item whose value begins at ``start``."""
        end = self.texts[-1][1] if self.texts else 0
        gap = _COMMENT.sub(lambda found: " " * len(found.group()), self.text[end:start])
        return end + gap.rindex("-")

    def scalar(self, event: ScalarEvent) -> Scalar:
        start, end = event.start_mark.index, event.end_mark.index
        source, style = self.text[start:end], event.style or ""
        if style not in ("|", ">"):
            if _has_place(event):
                self.texts.append((start, end))
            return Scalar(event.value, source, style)
        return Scalar(event.value, self.block(start, source), style)

    def block(self, start: int, source: str) -> str:
        """Return the source of a block without indentation and comment.

        The comment after ``|`` or ``>`` and the blank lines below the text do not belong to the block.
        """
        header, *lines = source.split("\n")
        found = _HEADER.match(header)
        assert found  # the parser recognised a block
        chomping = found[2] + found[4]
        if found[3]:
            indent = (self.inside[-1].column if self.inside else 0) + int(found[3])
        else:
            first = next((line for line in lines if line.strip()), "")
            indent = len(first) - len(first.lstrip(" "))
        if chomping == "+":
            lines.pop()
        else:
            while lines and not lines[-1][indent:]:
                lines.pop()
        begins = start + len(header)
        length = sum(len(line) + 1 for line in lines) + (chomping == "+")
        self.texts.append((begins, begins + length))
        return "\n".join([found[1] + chomping, *(line[indent:] for line in lines)])

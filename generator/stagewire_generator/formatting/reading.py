"""From the text of a file to its tree.

ruamel.yaml parses, and says where everything begins and ends. Between scalars there can be nothing but white
space, indicators and comments, so that no comment is missed. (ruamel.yaml keeps comments itself, but not
those within brackets, nor one between a key and its value.)
"""

from __future__ import annotations

import re
from collections.abc import Iterator

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

from stagewire_generator.formatting.comments import Anchor, Comment, attach
from stagewire_generator.formatting.tree import Collection, Entry, Node, Scalar

__all__ = ["comments", "read"]

_HEADER = re.compile(r"([|>])([+-]?)([1-9]?)([+-]?)")  # of a block
_COMMENT = re.compile(r"#[^\n]*")
_LOOSE = re.compile(r"#[^\n]*|(?<=\n)[ \t]*(?=\n)")  # a comment, or a blank line


def read(text: str) -> Node:
    """Return the tree of a file, with its comments and blank lines.

    :param text: YAML that the strict loader takes, with line feeds as line ends.
    Raises :class:`ruamel.yaml.error.YAMLError` where ruamel.yaml does not take it.
    """
    reader = _Reader(text)
    root = reader.document()
    if isinstance(root, Collection):
        reader.anchors.append(Anchor(len(text) + 1, (), None, closed=root))
        attach(_comments(text, reader.texts), reader.anchors)
    return root


def comments(text: str) -> list[str]:
    """Return the comments of a file in their order."""
    reader = _Reader(text)
    reader.document()
    return [comment.text for comment in _comments(text, reader.texts) if comment.text]


def _comments(text: str, texts: list[tuple[int, int]]) -> Iterator[Comment]:
    """Yield the comments and blank lines of a file, which stand between its scalars.

    :param texts: where the scalars begin and end, in the order of the file.
    """
    end = 0
    for begins, ends in [*texts, (len(text), len(text))]:
        for found in _LOOSE.finditer(text, end, begins):
            line = text.rfind("\n", 0, found.start()) + 1
            own_line = not text[line : found.start()].strip()
            yield Comment(found.start(), found.start() - line, own_line, found.group().strip())
        end = ends


def _has_place(event: Event) -> bool:
    """Whether a value has a first character of its own.

    A block begins with its first entry, and null may be written as nothing.
    """
    if isinstance(event, MappingStartEvent | SequenceStartEvent):
        return bool(event.flow_style)
    return bool(event.end_mark.index > event.start_mark.index)


class _Reader:
    """Makes the tree from the events of the parser, and remembers what comments can belong to.

    :ivar texts: where the scalars begin and end.
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
            assert isinstance(event, ScalarEvent)  # the strict loader takes no other key
            entry.key = self.scalar(event)
            event = next(self.events)
            if _has_place(event):
                self.anchors.append(Anchor(event.start_mark.index, self.inside, entry))
        entry.value = self.node(event, entry)
        return entry

    def dash(self, start: int) -> int:
        """Return where the dash of the item stands whose value begins at ``start``."""
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
        """Return a block with its lines as they are without indentation, and without comment.

        The comment behind ``|`` or ``>`` and the blank lines below the text are none of it.
        """
        header, *lines = source.split("\n")
        found = _HEADER.match(header)
        assert found  # the parser took it for a block
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

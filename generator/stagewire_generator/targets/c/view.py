"""The package: what all of its files have in common, and its chapters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stagewire_generator.model import Chapter, Protocol
from stagewire_generator.targets.c.documentation import where
from stagewire_generator.targets.c.framing import framing_of
from stagewire_generator.targets.c.named_view import TableView, enumeration_view, flag_table_view
from stagewire_generator.targets.c.names import Names, names_of
from stagewire_generator.targets.c.source import comment_lines, plain

__all__ = ["ChapterView", "PackageView", "package_view"]


@dataclass(frozen=True, slots=True)
class ChapterView:
    """One header of messages; ``doc`` is lines of a comment."""

    name: str
    doc: tuple[str, ...]
    messages: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class PackageView:
    """The package; ``p`` and ``P`` are what its names and its macros begin with."""

    names: Names
    title: str
    doc: tuple[str, ...]  # lines of a comment: what the protocol is
    framing: Any  # as the registry has it
    enumerations: tuple[TableView, ...]
    flags: tuple[TableView, ...]
    chapters: tuple[ChapterView, ...]

    @property
    def package(self) -> str:
        """The folder."""
        return self.names.package

    @property
    def p(self) -> str:
        """What types and functions begin with."""
        return self.names.prefix

    @property
    def P(self) -> str:
        """What macros begin with."""
        return self.names.macro_prefix


def package_view(protocol: Protocol) -> PackageView:
    """Make the view of a whole package."""
    names, document = names_of(protocol), protocol.document
    made = {message.chapter for message in protocol.messages if message.id is not None}
    return PackageView(
        names=names,
        title=plain(protocol.python_title),
        doc=comment_lines(
            [
                f"{protocol.title}, issue {document['issue']} of {document['date']}.",
                protocol.summary,
            ]
        ),
        framing=protocol.framing,
        enumerations=tuple(
            enumeration_view(names, protocol, e)
            for e in sorted(protocol.enumerations, key=lambda e: e.name)
        ),
        flags=tuple(
            flag_table_view(names, protocol, t)
            for t in sorted(protocol.flags, key=lambda t: t.name)
        ),
        chapters=tuple(_chapter(protocol, c) for c in protocol.chapters if c.name in made),
    )


def _chapter(protocol: Protocol, chapter: Chapter) -> ChapterView:
    make = framing_of(protocol).message_view
    found = where(protocol, [chapter.page], chapter.overlay)
    return ChapterView(
        name=chapter.name,
        doc=comment_lines([f"{chapter.title} (document {found}).", chapter.summary]),
        messages=tuple(
            make(protocol, message)
            for message in protocol.messages
            if message.chapter == chapter.name and message.id is not None
        ),
    )

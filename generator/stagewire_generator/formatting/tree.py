"""What stands in a file, for the formatter: the tree, its comments and its blank lines.

A tree is made by :mod:`.reading`, changed by :mod:`.rules` and written by :mod:`.layout`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

__all__ = ["BLANK", "Collection", "Entry", "Node", "Scalar"]

BLANK = ""
"""A blank line among comments."""


@dataclass(slots=True)
class Scalar:
    """A text, a number or a word; ``source`` is how it is spelled in the file.

    ``style`` is ``'"'``, ``"'"``, ``"|"`` or ``">"``, and empty for a plain one.
    """

    value: str
    source: str
    style: str = ""

    @property
    def block(self) -> bool:
        """Whether its lines stand below a ``|`` or ``>``."""
        return self.style in ("|", ">")


@dataclass(slots=True)
class Entry:
    """A key with its value, or an item of a list (which has no key), and the comments that are its own.

    :ivar before: comments on lines of their own above it, and blank lines.
    :ivar after: the comment at the end of its line.
    :ivar line: where it begins in the file, counted from zero.
    """

    key: Scalar | None
    value: Node
    line: int
    before: list[str] = field(default_factory=list)
    after: str = ""


@dataclass(slots=True)
class Collection:
    """A mapping or a list.

    :ivar flow: whether it stands in brackets.
    :ivar column: where its entries begin, counted from zero; of a block only.
    :ivar tail: comments behind its last entry.
    """

    mapping: bool
    flow: bool
    column: int
    entries: list[Entry] = field(default_factory=list)
    tail: list[str] = field(default_factory=list)

    def scalars(self) -> Iterator[Scalar]:
        """Yield the scalars of a list, those of the lists in it included."""
        for entry in self.entries:
            if isinstance(entry.value, Scalar):
                yield entry.value
            elif not entry.value.mapping:
                yield from entry.value.scalars()

    @property
    def commented(self) -> bool:
        """Whether comments stand in it; brackets on one line have no place for them."""
        return bool(self.tail) or any(
            entry.before
            or entry.after
            or (isinstance(entry.value, Collection) and entry.value.commented)
            for entry in self.entries
        )


Node = Scalar | Collection

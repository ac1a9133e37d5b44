"""Where a comment belongs: to the entry beside it, the one below it, or the end of a collection.

A comment at the end of a line belongs to what stands before it. One on a line of its own belongs to the
entry below; but if it is indented further than that entry, it ends the mapping or list above that is as
deep as the comment.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from stagewire_generator.formatting.tree import BLANK, Collection, Entry

__all__ = ["Anchor", "Comment", "attach"]


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment, or a blank line (an empty ``text``), where it stands in the file.

    :ivar start: index of its first character.
    :ivar column: counted from zero.
    :ivar own_line: whether nothing stands before it on its line.
    """

    start: int
    column: int
    own_line: bool
    text: str


@dataclass(frozen=True, slots=True)
class Anchor:
    """Where something begins or ends that comments can belong to.

    :ivar start: index of its first character.
    :ivar inside: the collections around it, from the outermost in.
    :ivar entry: the entry that begins here, has its value here, or has the brackets that close here.
    :ivar closed: the collection that ends here: that of the brackets, or the whole of the file.
    """

    start: int
    inside: tuple[Collection, ...]
    entry: Entry | None
    begins: bool = False
    closed: Collection | None = None

    @property
    def column(self) -> int:
        """The column of the entry that begins here in a block; -1 for anything else."""
        return self.inside[-1].column if self.begins and not self.inside[-1].flow else -1

    def above(self) -> list[str]:
        """Return the list that takes comments above this place."""
        if self.closed is not None:
            return self.closed.tail
        assert self.entry is not None  # what closes nothing is an entry or its value
        return self.entry.before

    def beside(self, text: str) -> None:
        """Take a comment at the end of the line; of several, the others stand above the entry."""
        if self.entry is None:
            self.above().append(text)
        elif self.entry.after:
            self.entry.before.append(text)
        else:
            self.entry.after = text


def attach(comments: Iterable[Comment], anchors: Sequence[Anchor]) -> None:
    """Give each comment and blank line to the entry or collection that it belongs to.

    Both are in the order of the file; the last anchor is the end of the file, behind all comments.
    """
    starts = [anchor.start for anchor in anchors]
    for index, group in groupby(comments, lambda comment: bisect_right(starts, comment.start)):
        _between(group, anchors[index - 1] if index else None, anchors[index])


def _between(comments: Iterable[Comment], before: Anchor | None, after: Anchor) -> None:
    """Give away the comments between two neighbouring anchors."""
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
    """Return those of the collections above a comment that it is not less indented than.

    A list may stand in the column of its key; then a comment there belongs to what is around it.
    """
    fitting = [collection for collection in closed if collection.column <= comment.column]
    while len(fitting) > 1 and fitting[-2].column == fitting[-1].column:
        fitting.pop()
    return fitting

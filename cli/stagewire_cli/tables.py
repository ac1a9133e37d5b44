"""Tables for people: columns on a wide terminal, labelled lines on a narrow one. Nothing is cut."""

from __future__ import annotations

from collections.abc import Iterator

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

_NARROW = 60
"""The width below which a table that does not fit is stacked, rather than wrapped in its columns."""


class StackingTable(Table):
    """A table that shows each row as labelled lines if its columns do not fit."""

    def __init__(self) -> None:
        super().__init__(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draw the columns, or each row as lines."""
        least, most = self.__rich_measure__(console, options.update_width(10_000))
        width = options.max_width
        if least > width or (width < _NARROW and most > width):
            yield from self._lines()
        else:
            yield from super().__rich_console__(console, options)

    def _lines(self) -> Iterator[Text]:
        columns = [(str(column.header), list(column.cells)) for column in self.columns]
        for number, row in enumerate(self.rows):
            if number:
                yield Text("")
            for label, cells in columns:
                if str(cells[number]):
                    text = f"{label}: {cells[number]}"
                    yield Text(text, style=row.style or "", overflow="fold")

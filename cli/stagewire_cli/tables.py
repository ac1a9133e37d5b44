"""Tables that fit narrow terminals: if a row does not fit without breaking words, its cells are listed.

Imported only on use, because importing Rich takes longer than running most commands.
"""

from __future__ import annotations

from collections.abc import Iterator

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

_UNBOUNDED = 10_000
_FILLED = 0.8  # of the width; Rich breaks words if the longest ones just fit


class FittingTable(Table):
    """A table, or for a narrow terminal one line for each cell: ``unit: TDC001``."""

    def __init__(self) -> None:
        super().__init__(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the table if its longest words fit, or else the cells of each row below each other."""
        wide = options.update(max_width=_UNBOUNDED)
        needed = self.__rich_measure__(console, wide).minimum
        if not console.is_terminal or needed <= _FILLED * options.max_width:
            yield from super().__rich_console__(console, options)
        else:
            yield from self._listed()

    def _listed(self) -> Iterator[Text]:
        cells = zip(*(column.cells for column in self.columns), strict=True)
        for number, (row, values) in enumerate(zip(self.rows, cells, strict=True)):
            if number:
                yield Text()
            for column, value in zip(self.columns, values, strict=True):
                if text := str(value).strip():
                    line = Text(f"{column.header}: {text}", style=row.style or "")
                    line.stylize("bold", 0, len(str(column.header)) + 1)
                    yield line

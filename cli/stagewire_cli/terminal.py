"""Output for people: a console that never cuts columns in a pipe, and text that cannot steer a terminal.

Rich is imported on use: most commands print plain lines, and would wait for it for nothing.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["console", "printable", "table"]

_PIPE_WIDTH = 200


def console(*, error: bool = False, file: TextIO | None = None) -> Console:
    """Return a console on standard output (or error) as it is now; text is printed as it stands.

    ``file`` is where to write instead.
    """
    from rich.console import Console

    stream = file or (sys.stderr if error else sys.stdout)
    width = None if stream.isatty() else _PIPE_WIDTH
    return Console(file=stream, width=width, markup=False, highlight=False, emoji=False)


def table(*columns: str, right: tuple[str, ...] = ()) -> Table:
    """Return an empty table; the columns named in ``right`` are aligned to the right."""
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for name in columns:
        made.add_column(name, justify="right" if name in right else "left", overflow="fold")
    return made


def printable(text: str) -> str:
    """Return text from outside with everything escaped that is no visible character."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)

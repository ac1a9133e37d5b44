"""Progress of what takes longer than two seconds: a status line on a terminal, plain lines elsewhere.

Where it is known how much there is, a terminal gets a bar.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from stagewire_cli.terminal import console

if TYPE_CHECKING:
    from rich.status import Status

__all__ = ["Progress", "bar", "progress"]

_PATIENCE = 2.0


class Progress:
    """Called with what is being done; silent for the first two seconds.

    :param lines: whether to print plain lines where standard error is no terminal.
    :param quiet: whether to say nothing at all.
    """

    def __init__(self, *, lines: bool = True, quiet: bool = False) -> None:
        self._quiet = quiet
        self._next = time.monotonic() + _PATIENCE
        self._status: Status | None = None
        self._lines = lines

    def __call__(self, text: str) -> None:
        """Say what is being done now."""
        if self._quiet:
            return
        now = time.monotonic()
        if self._status is not None:
            self._status.update(text)
        elif now >= self._next:
            self._next = now + _PATIENCE
            if sys.stderr.isatty():
                self._status = console(error=True).status(text)
                self._status.start()
            elif self._lines:
                print(f"... {text}", file=sys.stderr, flush=True)

    def stop(self) -> None:
        """Take the status line away."""
        if self._status is not None:
            self._status.stop()
            self._status = None


@contextmanager
def progress(*, lines: bool = True, quiet: bool = False) -> Iterator[Progress]:
    """Give a :class:`Progress` that is gone when the block ends."""
    shown = Progress(lines=lines, quiet=quiet)
    try:
        yield shown
    finally:
        shown.stop()


@contextmanager
def bar(first: str) -> Iterator[Callable[[int, int, str], None]]:
    """Give what shows on a terminal how many of how many are done, and what is done now.

    :param first: what is done before it is known how many there are.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with Bar(*columns, console=console(error=True), transient=True) as shown:
        task = shown.add_task(first, total=None)
        yield lambda done, total, text: shown.update(
            task, completed=done, total=total, description=text
        )

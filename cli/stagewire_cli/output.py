"""Output of commands: tables, progress, files and lists of paths.

Tables are never cut in a pipe, and printed text cannot control a terminal. Rich is imported on use, because
most commands print only plain lines.

Work that takes longer than a second shows its progress on a terminal: a status line, or a bar if the total is
known.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TextIO

import typer

from stagewire_cli.errors import CalledWronglyError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.status import Status
    from rich.table import Table

_PIPE_WIDTH = 200


def console(*, error: bool = False, file: TextIO | None = None) -> Console:
    """Return a console on the present standard output, or error, or on ``file``; it does not alter text."""
    from rich.console import Console

    stream = file or (sys.stderr if error else sys.stdout)
    width = None if stream.isatty() else _PIPE_WIDTH
    return Console(file=stream, width=width, markup=False, highlight=False, emoji=False)


def table(*columns: str, right: tuple[str, ...] = ()) -> Table:
    """Return an empty table; the columns named in ``right`` are aligned to the right.

    On a terminal that is too narrow for it, each row becomes labelled lines.
    """
    from stagewire_cli.tables import StackingTable

    made = StackingTable()
    for name in columns:
        made.add_column(name, justify="right" if name in right else "left", overflow="fold")
    return made


def echo_wrapped(text: str, *, indent: str = "") -> None:
    """Print a line; on a terminal, wrapped at its width with further lines indented."""
    if sys.stdout.isatty():
        width = max(20, shutil.get_terminal_size().columns)
        text = "\n".join(
            textwrap.wrap(
                text, width, subsequent_indent=indent, break_on_hyphens=False, drop_whitespace=True
            )
        )
    typer.echo(text)


def printable(text: str) -> str:
    """Return untrusted text with all non-printable characters escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


_PATIENCE = 1.0


class Progress:
    """A callable that shows the present activity on a terminal; silent for the first second.

    :param quiet: whether to print nothing.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet or not sys.stderr.isatty()
        self._begin = time.monotonic() + _PATIENCE
        self._status: Status | None = None

    @property
    def shows(self) -> bool:
        """Whether the activity would be shown now."""
        return not self._quiet and (self._status is not None or time.monotonic() >= self._begin)

    def __call__(self, text: str) -> None:
        """Show the present activity."""
        if not self.shows:
            return
        if self._status is not None:
            self._status.update(text)
        else:
            self._status = console(error=True).status(text)
            self._status.start()

    def stop(self) -> None:
        """Remove the status line."""
        if self._status is not None:
            self._status.stop()
            self._status = None


@contextmanager
def progress(*, quiet: bool = False) -> Iterator[Progress]:
    """Yield a :class:`Progress`, which is removed when the block ends."""
    shown = Progress(quiet=quiet)
    try:
        yield shown
    finally:
        shown.stop()


@contextmanager
def bar(first: str) -> Iterator[Callable[[int, int, str], None]]:
    """Yield a function that shows a progress bar with counts and the present activity on a terminal.

    Without a terminal, the function does nothing.

    :param first: the activity to show before the total is known.
    """
    if not sys.stderr.isatty():
        yield lambda done, total, text: None
        return
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


def check_output(path: Path, source: Path | None, option: str = "--output") -> None:
    """Raise :class:`CalledWronglyError` if the file cannot be created or would replace the input.

    :param option: the option that names the file.

    An existing regular file is replaced, as by ``cp``, except for the capture that is read.
    """
    if not path.name:
        raise CalledWronglyError(f"{option}: give the name of a file")
    if source is not None and path.exists() and path.samefile(source):
        raise CalledWronglyError(f"{option}: {path} is the capture that is being read")
    if path.exists() and not path.is_file():
        instead = "; without --output text goes to standard output" if option == "--output" else ""
        raise CalledWronglyError(f"{option}: {path} is not a regular file{instead}")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise CalledWronglyError(f"{option}: missing folder {folder}")
    if not os.access(folder, os.W_OK):
        raise CalledWronglyError(f"{option}: no permission to create a file in {folder}")


@contextmanager
def output(path: Path | None, *, binary: bool = False) -> Iterator[IO[Any]]:
    """Yield a stream to write to; a file gets its name when the block ends without an exception.

    Until then it has a temporary name in the same folder. It is removed if the block fails.
    """
    if path is None:
        yield sys.stdout
        return
    target = Path(os.path.realpath(path))  # replaces the target of a symbolic link, not the link
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    encoding = None if binary else "utf-8"
    try:
        with part.open("xb" if binary else "x", encoding=encoding) as file:
            yield file
        part.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def show_paths(paths: Iterable[Path]) -> None:
    """Print paths sorted and with slashes, on every system.

    Raises :class:`CalledWronglyError` before printing if a path does not fit in one line of text.
    """
    lines = sorted(path.as_posix() for path in paths)
    for line in lines:
        if len(line.splitlines()) != 1 or not _written(line):
            raise CalledWronglyError(f"{line!r} cannot be listed: rename it")
    for line in lines:
        typer.echo(line)


def _written(text: str) -> bool:
    """Return whether a name is valid text; some systems also have names of arbitrary bytes."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True

"""Lists of paths for build systems: one a line on standard output, and nothing else there."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import typer

from stagewire_cli.errors import CalledWronglyError

__all__ = ["show_paths"]


def show_paths(paths: Iterable[Path]) -> None:
    """Print paths sorted and with slashes, on every system.

    Raises :class:`CalledWronglyError` for a path that a line cannot hold; half a list is worse than none.
    """
    lines = sorted(path.as_posix() for path in paths)
    for line in lines:
        if len(line.splitlines()) != 1 or not _written(line):
            raise CalledWronglyError(f"{line!r} cannot be listed: rename it")
    for line in lines:
        typer.echo(line)


def _written(text: str) -> bool:
    """Whether a name is text; systems have names that are only bytes."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True

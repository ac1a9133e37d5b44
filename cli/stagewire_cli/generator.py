"""The way to the generator, which comes with an extra of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.progress import progress

if TYPE_CHECKING:
    from stagewire_generator.diagnostics import SpecError
    from stagewire_generator.model import Protocol
    from stagewire_generator.pipeline import Counts

__all__ = ["folder", "load", "show_diagnostics", "the_generator"]


def folder(text: str | Path) -> Path:
    """Return the folder that an option names; an empty name, as of an unset variable, is none."""
    if not str(text).strip():
        raise typer.BadParameter("the name of a folder is empty")
    return Path(text)


@contextmanager
def the_generator() -> Iterator[None]:
    """Import the generator inside this block; without its extra it says how to get it."""
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in ("jinja2", "yaml", "jsonschema", "stagewire_generator"):
            raise
        raise CalledWronglyError(
            f"this command needs {name}; it comes with pip install 'stagewire[generator]'"
        ) from None


def load(folders: Sequence[Path]) -> tuple[list[Protocol], dict[str, Counts]]:
    """Read and check every spec; raise ``SpecError`` with the diagnostics of all of them.

    Returns the protocols, and what was looked at by protocol.
    """
    from stagewire_generator.diagnostics import Diagnostic, SpecError
    from stagewire_generator.pipeline import check

    for folder in folders:
        if not folder.is_dir():
            raise CalledWronglyError(
                f"{folder} is no folder; give one that holds protocols, such as ./spec"
            )
    protocols: list[Protocol] = []
    counts: dict[str, Counts] = {}
    found: list[Diagnostic] = []
    with progress() as say:
        for folder in folders:
            try:
                protocols += check(folder, say, counts)
            except SpecError as error:
                found += error.diagnostics
    if found:
        raise SpecError(found)
    names = [protocol.name for protocol in protocols]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CalledWronglyError(f"{', '.join(twice)} comes from more than one of the folders")
    return protocols, counts


def show_diagnostics(error: SpecError, folders: Sequence[Path]) -> None:
    """Print every diagnostic, and on standard error how many the folders gave."""
    for diagnostic in error.diagnostics:
        typer.echo(str(diagnostic))
    number = len(error.diagnostics)
    where = ", ".join(map(str, folders))
    typer.echo(f"{where}: {number} error{'s' * (number != 1)}", err=True)

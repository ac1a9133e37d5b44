"""``stagewire schemas``: the JSON Schemas for editors, in a folder beside somebody's own spec."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG
from stagewire_cli.generator import folder, the_generator
from stagewire_cli.terminal import printable

__all__ = ["EXAMPLE", "schemas"]

EXAMPLE = """\b
Examples:
  stagewire schemas spec/schema
  stagewire schemas spec/schema --check
"""


def schemas(
    out: Annotated[
        Path, typer.Argument(parser=folder, metavar="FOLDER", help="Folder to write to.")
    ],
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; report what would change.")
    ] = False,
) -> None:
    """Write the JSON Schemas of spec files to a folder, or check that they are there.

    Editors find them by the first line of each file, which `stagewire format` writes.
    """
    with the_generator():
        from stagewire_generator.output import OutputError, compare, write
        from stagewire_generator.schemas import schema_texts
    files = schema_texts()
    if check:
        changes = [change for change in compare(out, files) if change.kind != "orphaned"]
        for change in changes:
            typer.echo(f"{change.kind}: {printable(change.path)}")
        if changes:
            typer.echo(f"{out} has not the schemas of this stagewire", err=True)
            raise typer.Exit(WRONG)
        typer.echo(f"{out}: {len(files)} schemas, all as they should be")
        return
    try:
        touched = write(out, files, partial=True)
    except OutputError as error:
        typer.echo(f"stagewire: {error}", err=True)
        raise typer.Exit(WRONG) from None
    for path in touched:
        typer.echo(path)
    typer.echo(f"{out}: {len(files)} schemas, {len(touched)} files written")

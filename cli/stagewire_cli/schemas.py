"""``stagewire schemas``: the JSON Schemas for editors, in a folder beside somebody's own spec."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG
from stagewire_cli.generator import folder, the_generator, write_files
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
        from stagewire_generator.output import compare
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
    touched = write_files(out, files, partial=True)
    typer.echo(f"{out}: {len(files)} schemas, {touched} files written")

"""``stagewire check``: whether a spec is right."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG
from stagewire_cli.generator import folder, load, show_diagnostics, the_generator

__all__ = ["EXAMPLE", "check"]

EXAMPLE = """\b
Example:
  stagewire check spec
"""


def check(
    spec: Annotated[
        Path,
        typer.Argument(
            parser=folder, metavar="SPEC", help="Folder that holds one or more protocols."
        ),
    ] = Path("spec"),
) -> None:
    """Check a spec and report everything that is wrong with it."""
    with the_generator():
        from stagewire_generator.diagnostics import SpecError
    try:
        _, counts = load([spec])
    except SpecError as error:
        show_diagnostics(error, [spec])
        raise typer.Exit(WRONG) from None
    for name, seen in counts.items():
        typer.echo(
            f"{name}: ok; {seen.messages} messages, {seen.layouts} layouts, {seen.fields} fields, "
            f"{seen.errata} errata, {seen.places} witness places, {seen.examples} examples"
        )

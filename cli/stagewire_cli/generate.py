"""``stagewire generate``: from the spec to every binding."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.generator import folder, load, the_generator
from stagewire_cli.progress import progress

__all__ = ["EXAMPLE", "generate"]

EXAMPLE = """\b
Examples:
  stagewire generate --spec spec --out generated
  stagewire generate --check
"""


def generate(
    spec: Annotated[
        list[Path] | None,
        typer.Option(
            "--spec",
            parser=folder,
            metavar="FOLDER",
            help="Folder that holds protocols; may be repeated.  [default: spec]",
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option("--out", parser=folder, metavar="FOLDER", help="Folder to write to."),
    ] = Path("generated"),
    target: Annotated[
        list[str] | None,
        typer.Option("--target", help="Only this target; may be repeated.  [default: all]"),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; report what would change.")
    ] = False,
) -> None:
    """Generate all bindings from a spec, or check that they are what it gives."""
    with the_generator():
        from stagewire_generator import TARGETS, render
        from stagewire_generator.diagnostics import SpecError
        from stagewire_generator.output import OutputError, compare, write
    for name in target or []:
        if name not in TARGETS:
            raise CalledWronglyError(f"there is no target {name} (there are: {', '.join(TARGETS)})")
    try:
        protocols, _ = load(spec or [Path("spec")])
    except SpecError as error:
        for diagnostic in error.diagnostics:
            typer.echo(str(diagnostic))
        typer.echo(
            f"{error}; {'nothing was compared' if check else 'nothing was written'}", err=True
        )
        raise typer.Exit(WRONG) from None
    with progress() as say:
        say("rendering")
        files = render(protocols, target)
    if check:
        changes = compare(out, files)
        if target:  # the rest of the folder belongs to other targets
            changes = [change for change in changes if change.kind != "orphaned"]
        for change in changes:
            typer.echo(f"{change.kind}: {change.path}")
            if change.diff:
                typer.echo(change.diff)
        if changes:
            count = {kind: sum(c.kind == kind for c in changes) for kind in _KINDS}
            listed = ", ".join(f"{number} {kind}" for kind, number in count.items() if number)
            typer.echo(f"{out} is not what the spec gives: {listed}", err=True)
            raise typer.Exit(WRONG)
        typer.echo(f"{out}: {len(files)} files, not one byte drifted")
        return
    try:
        touched = write(out, files, partial=bool(target))
    except OutputError as error:
        typer.echo(f"stagewire: {error}", err=True)
        raise typer.Exit(WRONG) from None
    for path in touched:
        typer.echo(path)
    typer.echo(f"{out}: {len(files)} files, {len(touched)} written or removed")


_KINDS = ("changed", "missing", "orphaned")

"""``stagewire generate``: from the spec to every binding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.generator import folder, load, show_diagnostics, the_generator
from stagewire_cli.progress import progress
from stagewire_cli.terminal import printable

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
    for name in target or []:
        if name not in TARGETS:
            raise CalledWronglyError(f"there is no target {name} (there are: {', '.join(TARGETS)})")
    folders = spec or [Path("spec")]
    try:
        protocols, _ = load(folders)
    except SpecError as error:
        show_diagnostics(error, folders)
        typer.echo(f"nothing was {'compared' if check else 'written'}", err=True)
        raise typer.Exit(WRONG) from None
    with progress() as say:
        say("rendering")
        files = render(protocols, target)
    if check:
        _compare(out, files, partial=bool(target))
    else:
        _write(out, files, partial=bool(target))


def _compare(out: Path, files: Mapping[str, str], *, partial: bool) -> None:
    """Report every difference between the folder and the files that belong there."""
    from stagewire_generator.output import compare

    changes = compare(out, files)
    if partial:  # the rest of the folder belongs to other targets
        changes = [change for change in changes if change.kind != "orphaned"]
    for change in changes:
        typer.echo(f"{change.kind}: {printable(change.path)}")
        for line in change.diff.splitlines():  # of a file that anybody may have written
            typer.echo(printable(line))
    if changes:
        count = Counter(change.kind for change in changes)
        listed = ", ".join(f"{number} {kind}" for kind, number in sorted(count.items()))
        typer.echo(f"{out} is not what the spec gives: {listed}", err=True)
        raise typer.Exit(WRONG)
    typer.echo(f"{out}: {len(files)} files, not one byte drifted")


def _write(out: Path, files: Mapping[str, str], *, partial: bool) -> None:
    """Write the files and say which of them were not there as they are now."""
    from stagewire_generator.output import OutputError, write

    try:
        touched = write(out, files, partial=partial)
    except OutputError as error:
        typer.echo(f"stagewire: {error}", err=True)
        raise typer.Exit(WRONG) from None
    for path in touched:
        typer.echo(path)
    typer.echo(f"{out}: {len(files)} files, {len(touched)} written or removed")

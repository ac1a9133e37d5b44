"""``stagewire format``: rewrite the YAML of a spec in canonical form, with all its comments."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.generator import folder, generator_extra
from stagewire_cli.output import printable, progress

EXAMPLE = """\b
Examples:
  stagewire format
  stagewire format spec/thorlabs_apt/units.yaml
  stagewire format --check spec
"""


def format_files(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(
            parser=folder,
            metavar="PATH",
            help="Files, or folders that contain specs.  [default: spec]",
            show_default=False,
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; report what would change.")
    ] = False,
) -> None:
    """Format the files of a spec, or check that they are formatted.

    A folder includes the worked examples and captures next to it. A file that is not valid YAML is
    reported and left unchanged.
    """
    with generator_extra():
        from stagewire_generator.formatting import format_file
    states: Counter[str] = Counter()
    lacking: set[Path] = set()
    with progress() as say:
        for path in _files(paths or [Path("spec")]):
            say(str(path))
            outcome = format_file(path, write=not check)
            states[outcome.state] += 1
            if outcome.no_schemas:
                lacking.add(outcome.no_schemas)
            if outcome.state == "formatted":
                typer.echo(f"{'would change' if check else 'formatted'}: {printable(str(path))}")
            if check and outcome.diff:
                typer.echo("\n".join(map(printable, outcome.diff.splitlines())))
            for diagnostic in outcome.diagnostics:
                typer.echo(str(diagnostic))
            if outcome.reason:
                typer.echo(printable(f"{path}: {outcome.reason}"))
    for place in sorted(lacking):
        typer.echo(
            f"note: editors look for schemas in {printable(str(place))}; "
            "run `stagewire schemas` to write them there",
            err=True,
        )
    _sum_up(states, check=check)
    if states["left"] or (check and states["formatted"]):
        raise typer.Exit(WRONG)


def _files(paths: Sequence[Path]) -> list[Path]:
    """Return the named files, and the files in the named folders."""
    from stagewire_generator.formatting import find

    found: dict[Path, None] = {}
    for path in paths:
        if path.is_dir():
            inside = find(path)
            if not inside:
                raise CalledWronglyError(f"{path} contains no file of a spec")
            found |= dict.fromkeys(inside)
        elif path.exists() or path.is_symlink():
            found[path] = None
        else:
            raise CalledWronglyError(f"{path} does not exist; give a file or folder")
    return list(found)


def _sum_up(states: Counter[str], *, check: bool) -> None:
    number = states.total()
    changed = f"{states['formatted']} {'would change' if check else 'formatted'}"
    left = f", {states['left']} left unchanged" if states["left"] else ""
    wrong = bool(states["left"] or (check and states["formatted"]))
    typer.echo(f"{number} file{'s' * (number != 1)}, {changed}{left}", err=wrong)

"""One side of a comparison: the spec of a folder or of a git revision."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stagewire_cli.errors import CALLED_WRONGLY, CalledWronglyError
from stagewire_cli.generator import load, show_diagnostics

if TYPE_CHECKING:
    from stagewire_generator.change import Revision, Spec
    from stagewire_generator.checks import Checked

__all__ = ["side"]


@contextmanager
def side(label: str, name: str, spec: str, *, quiet: bool = False) -> Iterator[Spec]:
    """Give a folder or revision; show why it cannot be had, and end with 2.

    :param label: what the user calls the side: ``OLD``.
    :param name: the folder or revision.
    :param spec: the folder of the spec in a revision, from the current folder.
    :param quiet: whether standard output is for programs, so that diagnostics go to standard error.
    Raises :class:`CalledWronglyError` for what is neither.
    """
    from stagewire_generator.change import RevisionError, revision

    if not name.strip():
        raise CalledWronglyError(f"the name of {label} is empty; give a folder or a revision")
    if Path(name).is_dir():
        yield _loaded(label, name, Path(name), quiet=quiet)
        return
    try:
        with revision(name, spec) as extracted:
            yield _loaded(label, name, extracted.spec, extracted, quiet=quiet)
    except RevisionError as error:
        raise CalledWronglyError(
            f"{label}, {name}, is no folder, and as a revision it cannot be read: {error}"
        ) from None


def _loaded(
    label: str, name: str, folder: Path, extracted: Revision | None = None, *, quiet: bool
) -> Spec:
    from stagewire_generator.change import Spec
    from stagewire_generator.diagnostics import SpecError

    checked: dict[str, Checked] = {}
    try:
        load([folder], checked, named=extracted.named if extracted else None)
        return Spec.of(checked)
    except SpecError as error:
        show_diagnostics(error, [Path(name)], err=quiet)
        typer.echo(f"{label} does not pass check, so that nothing was compared", err=True)
        if extracted is not None:
            typer.echo(
                "it was checked by the rules of this stagewire; for a spec that was written for "
                "another one, compare with the stagewire of its time",
                err=True,
            )
        raise typer.Exit(CALLED_WRONGLY) from None

"""Access to the generator, which is an optional extra.

Each side of a comparison is the spec in a folder or in a git revision. Paths are relative to the current
folder, so that terminals, editors and programs can open them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stagewire_cli.errors import CALLED_WRONGLY, WRONG, CalledWronglyError
from stagewire_cli.output import printable, progress

if TYPE_CHECKING:
    from stagewire_generator.change import Revision, Spec
    from stagewire_generator.diagnostics import Diagnostic, SpecError
    from stagewire_generator.model import Protocol
    from stagewire_generator.pipeline import Checked, CheckedSpec
    from stagewire_generator.reader import SpecFolder


def located(diagnostics: Iterable[Diagnostic], spec: SpecFolder) -> list[Diagnostic]:
    """Return the diagnostics of a spec with file paths from the current folder."""
    path = cache(
        lambda name: relative_path(spec.locate(name))
    )  # one file may have thousands of diagnostics
    return [
        replace(diagnostic, place=replace(diagnostic.place, file=path(diagnostic.place.file)))
        for diagnostic in diagnostics
    ]


def relative_path(path: Path) -> str:
    """Return a path relative to the current folder if it is below it, else the absolute path."""
    path, here = Path(os.path.abspath(path)), Path.cwd()
    return (path.relative_to(here) if path.is_relative_to(here) else path).as_posix()


def folder(text: str | Path) -> Path:
    """Return the folder that an option names; refuse an empty name, as from an unset variable."""
    if not str(text).strip():
        raise typer.BadParameter("the name of a folder is empty")
    return Path(text)


@contextmanager
def generator_extra() -> Iterator[None]:
    """Import the generator inside this block; if its extra is missing, say how to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in (
            "jinja2",
            "yaml",
            "jsonschema",
            "jsonschema_rs",
            "junitparser",
            "ruamel",
            "stagewire_generator",
        ):
            raise
        raise CalledWronglyError(
            f"this command needs {name}: run pip install 'stagewire[generator]'"
        ) from None


def find(folders: Sequence[Path]) -> list[SpecFolder]:
    """Return the files of every spec; raise :class:`CalledWronglyError` if one is not a folder."""
    with generator_extra():
        from stagewire_generator.reader import find_spec
    for folder in folders:
        if not folder.is_dir():
            raise CalledWronglyError(
                f"{folder} is not a folder; give a folder with protocols, such as ./spec"
            )
    return [find_spec(folder) for folder in folders]


def _check_overlays(specs: Sequence[SpecFolder], overlays: Sequence[str]) -> None:
    """Raise :class:`CalledWronglyError` for an overlay that is unknown or given twice."""
    known = sorted(
        f"{protocol.path.name}/{overlay.path.name}"
        for spec in specs
        for protocol in spec.protocols
        for overlay in protocol.overlays
    )
    for name in overlays:
        if name not in known:
            there = (
                f"choose from {printable(', '.join(known))}"
                if known
                else "the spec has no overlays"
            )
            raise CalledWronglyError(f"unknown overlay {name} ({there})")
        if overlays.count(name) > 1:
            raise CalledWronglyError(f"--overlay {name} is given twice")


def load(
    specs: Sequence[SpecFolder],
    overlays: Sequence[str] = (),
    *,
    base: bool = False,
    named: Callable[[Diagnostic], Diagnostic] | None = None,
) -> CheckedSpec:
    """Read and check every spec; raise ``SpecError`` with the diagnostics of all of them.

    :param overlays: ``PROTOCOL/OVERLAY``, to be applied to their protocols in this order, besides those that
        are on by default.
    :param base: leave out the overlays that are on by default.
    :param named: replaces the file name of a diagnostic; by default it is the path from the current folder.
    """
    from stagewire_generator.diagnostics import SpecError
    from stagewire_generator.naming import c_prefix
    from stagewire_generator.pipeline import CheckedSpec, check

    _check_overlays(specs, overlays)
    protocols: list[Protocol] = []
    checked: dict[str, Checked] = {}
    found: list[Diagnostic] = []
    with (
        generator_extra(),
        progress() as say,
    ):  # modules that explain errors are imported on demand
        for spec in specs:
            try:
                result = check(spec, say, overlays, base=base)
                protocols += result
                checked |= result.checked
            except SpecError as error:
                found += (
                    map(named, error.diagnostics) if named else located(error.diagnostics, spec)
                )
    if found:
        raise SpecError(found)
    taken = {
        "protocol": [p.name for p in protocols],
        "package": [p.package for p in protocols],
        "C prefix": [c_prefix(p.package) for p in protocols],
    }
    for noun, names in taken.items():  # the output of one would overwrite that of the other
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise CalledWronglyError(
                f"more than one of the folders has the {noun} {', '.join(twice)}"
            )
    return CheckedSpec(tuple(protocols), checked)


def show_diagnostics(error: SpecError, folders: Sequence[Path], *, err: bool = False) -> None:
    """Print every diagnostic, and their number on standard error.

    :param err: whether diagnostics also go to standard error, because the output is for programs.
    """
    for diagnostic in error.diagnostics:
        typer.echo(str(diagnostic), err=err)
    number = len(error.diagnostics)
    where = ", ".join(map(str, folders))
    typer.echo(f"{where}: {number} error{'s' * (number != 1)}", err=True)


def write_files(out: Path, files: Mapping[str, str], *, partial: bool) -> int:
    """Write files to a folder, print the paths that changed, and return their number.

    :param partial: whether other files in the folder belong to other targets.
    Prints an error and exits with 1 if a file of the user would be lost.
    """
    from stagewire_generator.output import OutputError, write

    try:
        touched = write(out, files, partial=partial)
    except OutputError as error:
        typer.echo(f"stagewire: {error}", err=True)
        raise typer.Exit(WRONG) from None
    for path in touched:
        typer.echo(path)
    return len(touched)


@contextmanager
def compared_spec(label: str, name: str, spec: str, *, quiet: bool = False) -> Iterator[Spec]:
    """Yield the spec of a folder or revision; if it has errors, print them and exit with 2.

    :param label: the name of this side for the user: ``OLD``.
    :param name: the folder or revision.
    :param spec: the folder of the spec in a revision, relative to the current folder.
    :param quiet: whether standard output is for programs, so that diagnostics go to standard error.
    Raises :class:`CalledWronglyError` if it is neither.
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
            f"{label} ({name}) is neither a folder nor a readable revision: {error}"
        ) from None


def _loaded(
    label: str, name: str, folder: Path, extracted: Revision | None = None, *, quiet: bool
) -> Spec:
    from stagewire_generator.change import Spec
    from stagewire_generator.diagnostics import SpecError

    try:
        named = extracted.named if extracted else None
        return Spec.of(load(find([folder]), named=named).checked)
    except SpecError as error:
        show_diagnostics(error, [Path(name)], err=quiet)
        typer.echo(f"{label} does not pass check, so nothing was compared", err=True)
        if extracted is not None:
            typer.echo(
                "it was checked with the rules of this version of Stagewire; if the spec was written "
                "for an older version, run the comparison with that version",
                err=True,
            )
        raise typer.Exit(CALLED_WRONGLY) from None

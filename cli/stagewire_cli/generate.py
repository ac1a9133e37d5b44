"""``stagewire generate`` and ``stagewire schemas``: bindings from a spec, and JSON Schemas for editors."""

from __future__ import annotations

import difflib
import functools
import gc
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.generator import (
    find,
    folder,
    generator_extra,
    load,
    show_diagnostics,
    write_files,
)
from stagewire_cli.output import printable, progress, show_paths

TYPE_CHECKING = False
if TYPE_CHECKING:
    from stagewire_generator.model import Protocol

EXAMPLE = """\b
Examples:
  stagewire generate --spec spec --out generated
  stagewire generate --check
  stagewire generate --spec-dir mine/spec --package acme_turntable --out mine/generated
  stagewire generate --base --out issue_3
  stagewire generate --base --overlay thorlabs_apt/later_issues --out later
  stagewire generate --unit TDC001 --out small
  stagewire generate --list-inputs
  stagewire generate --templates my-templates --out generated
  stagewire generate --target c --target c-tests --out build
"""


def generate(
    spec: Annotated[
        list[Path] | None,
        typer.Option(
            "--spec",
            "--spec-dir",
            parser=folder,
            metavar="FOLDER",
            help="Folder of protocols; may be repeated.  [default: spec]",
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option("--out", parser=folder, metavar="FOLDER", help="Folder to write to."),
    ] = Path("generated"),
    target: Annotated[
        list[str] | None,
        typer.Option(
            "--target",
            metavar="NAME",
            help="c, c-tests, python, registry or vectors; may be repeated.  [default: c and python]",
        ),
    ] = None,
    package: Annotated[
        str | None,
        typer.Option(
            "--package",
            metavar="NAME",
            help="Write a Python project that pip can install, with a package of this name. "
            "Requires a spec with a single protocol.",
        ),
    ] = None,
    overlay: Annotated[
        list[str] | None,
        typer.Option(
            "--overlay",
            metavar="PROTOCOL/OVERLAY",
            help="Also apply this overlay (a later issue) to its protocol; may be repeated, in order.",
        ),
    ] = None,
    base: Annotated[
        bool,
        typer.Option("--base", help="Leave out the overlays that are on by default."),
    ] = False,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            "--unit",
            metavar="UNIT",
            help="Generate only the messages of this unit and what they use; may be repeated.",
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; report what would change.")
    ] = False,
    templates: Annotated[
        Path | None,
        typer.Option(
            "--templates",
            parser=folder,
            metavar="FOLDER",
            help="Folder of templates that replace built-in ones with the same name.",
        ),
    ] = None,
    list_outputs: Annotated[
        bool,
        typer.Option("--list-outputs", help="Write nothing; list the files that would be written."),
    ] = False,
    list_inputs: Annotated[
        bool,
        typer.Option(
            "--list-inputs", help="Write nothing; list the files that determine the output."
        ),
    ] = False,
    list_templates: Annotated[
        bool,
        typer.Option("--list-templates", help="List the built-in templates, with their paths."),
    ] = False,
    cmake_dir: Annotated[
        bool, typer.Option("--cmake-dir", help="Print the folder of StagewireGenerate.cmake.")
    ] = False,
) -> None:
    """Generate code from a spec, or check that it is up to date."""
    _only_one(
        {
            "--check": check,
            "--list-outputs": list_outputs,
            "--list-inputs": list_inputs,
            "--list-templates": list_templates,
            "--cmake-dir": cmake_dir,
        }
    )
    with generator_extra():
        import stagewire_generator
        from stagewire_generator import TARGETS
        from stagewire_generator.naming import why_no_project
        from stagewire_generator.output import MANIFEST
        from stagewire_generator.targets.environment import our_templates
    folders = spec or [Path("spec")]
    for name in target or []:
        if name not in TARGETS:
            raise CalledWronglyError(f"unknown target {name} (choose from {', '.join(TARGETS)})")
    if package is not None and (why := why_no_project(package)):
        raise CalledWronglyError(f"--package {package}: {why}")
    if templates is not None and not templates.is_dir():
        raise CalledWronglyError(f"{templates} is not a folder; give a folder with templates")
    gc.disable()  # nearly all objects live until the end, so searching for others is in vain
    rendered = functools.partial(
        _render,
        folders,
        target,
        templates,
        package or "",
        overlays=overlay or [],
        base=base,
        units=unit or [],
    )
    if list_templates:
        show_paths(our_templates())
    elif cmake_dir:
        show_paths([Path(stagewire_generator.__file__).parent / "cmake"])
    elif list_inputs:
        _list_inputs(folders, templates)
    elif list_outputs:
        files = rendered("listed", err=True)
        show_paths(out / path for path in {*files, MANIFEST})
    elif check:
        _compare(out, rendered("compared"), partial=bool(target))
    else:
        files = rendered("written")
        touched = write_files(out, files, partial=bool(target))
        typer.echo(f"{out}: {len(files)} files, {touched} written or removed")


def _only_one(modes: Mapping[str, bool]) -> None:
    """Raise :class:`CalledWronglyError` if more than one of the options is given."""
    given = [name for name, wanted in modes.items() if wanted]
    if len(given) > 1:
        raise CalledWronglyError(f"{' and '.join(given)} cannot be combined")


def _render(
    folders: Sequence[Path],
    targets: list[str] | None,
    templates: Path | None,
    package: str,
    undone: str,
    *,
    overlays: Sequence[str] = (),
    base: bool = False,
    units: Sequence[str] = (),
    err: bool = False,
) -> dict[str, str]:
    """Return path -> text of all files; if the spec or a template is invalid, print the errors and exit.

    :param package: the name of the package of the only protocol; empty for no project.
    :param undone: a word for the work that is not done in that case, such as ``written``.
    :param overlays: the overlays to apply, in order, besides those that are on by default.
    :param base: leave out the overlays that are on by default.
    :param units: the units to generate code for; empty for all.
    :param err: whether diagnostics also go to standard error.
    """
    from stagewire_generator import SpecError, render
    from stagewire_generator.lint.c_names import why_no_prefix
    from stagewire_generator.targets.templates import Templates, TemplatesError

    try:
        protocols = _reduced(load(find(folders), overlays, base=base), units)
        if package and len(protocols) != 1:
            names = ", ".join(sorted(protocol.name for protocol in protocols))
            raise CalledWronglyError(
                f"--package requires a single protocol, not {len(protocols)}: {names}; "
                "give the folder of one of them"
            )
        if package and (why := why_no_prefix(protocols[0], package)):
            raise CalledWronglyError(f"--package {package}: {why}")
        with progress() as say:
            say("rendering")
            return render(protocols, targets, Templates(templates), package)
    except SpecError as error:
        show_diagnostics(error, folders, err=err)
    except TemplatesError as error:
        for line in str(error).split("\n"):
            typer.echo(f"stagewire: {printable(line)}", err=True)
    typer.echo(f"nothing was {undone}", err=True)
    raise typer.Exit(WRONG)


def _reduced(protocols: Sequence[Protocol], units: Sequence[str]) -> Sequence[Protocol]:
    """Return the protocols that have some of the units, each reduced to these; without units, all."""
    if not units:
        return protocols
    from stagewire_generator.reduction import reduced, units_of

    known = {name.upper(): name for protocol in protocols for name in sorted(units_of(protocol))}
    for name in units:
        for protocol in protocols:
            if reason := protocol.units.get("unsupported", {}).get(name, {}).get("reason"):
                raise CalledWronglyError(f"--unit {name}: this unit is not supported: {reason}")
        if name.upper() not in known:
            close = difflib.get_close_matches(name.upper()[:80], known, n=3)
            meant = (
                f"did you mean {' or '.join(known[key] for key in close)}?"
                if close
                else f"choose from {', '.join(sorted(known.values()))}"
            )
            raise CalledWronglyError(f"--unit {name}: unknown unit ({meant})")
    wanted = {known[name.upper()] for name in units}
    chosen = {protocol: wanted & units_of(protocol) for protocol in protocols}
    return [reduced(protocol, names) for protocol, names in chosen.items() if names]


def _list_inputs(folders: Sequence[Path], templates: Path | None) -> None:
    """List the input files, also those of an invalid spec."""
    from stagewire_generator.pipeline import inputs

    specs = find(folders)
    for spec in specs:
        if not spec.protocols:
            raise CalledWronglyError(f"{spec.path} contains no folder with a protocol.yaml")
    show_paths(inputs(specs, templates))


def _compare(out: Path, files: Mapping[str, str], *, partial: bool) -> None:
    """Report every difference between the folder and the generated files."""
    from stagewire_generator.output import compare

    changes = compare(out, files)
    if partial:  # other files belong to other targets
        changes = [change for change in changes if change.kind != "orphaned"]
    for change in changes:
        typer.echo(f"{change.kind}: {printable(change.path)}")
        for line in change.diff.splitlines():  # the file may contain control characters
            typer.echo(printable(line))
    if changes:
        count = Counter(change.kind for change in changes)
        listed = ", ".join(f"{number} {kind}" for kind, number in sorted(count.items()))
        typer.echo(f"{out} is not up to date: {listed}", err=True)
        raise typer.Exit(WRONG)
    typer.echo(f"{out}: {len(files)} files, up to date")


SCHEMAS_EXAMPLE = """\b
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
    """Write or check the JSON Schemas of spec files.

    Editors find the schema of a file by its first line, which `stagewire format` writes.
    """
    with generator_extra():
        from stagewire_generator.output import compare
        from stagewire_generator.schemas import schema_texts
    files = schema_texts()
    if check:
        changes = [change for change in compare(out, files) if change.kind != "orphaned"]
        for change in changes:
            typer.echo(f"{change.kind}: {printable(change.path)}")
        if changes:
            typer.echo(f"{out} does not contain the schemas of this version of Stagewire", err=True)
            raise typer.Exit(WRONG)
        typer.echo(f"{out}: {len(files)} schemas, up to date")
        return
    touched = write_files(out, files, partial=True)
    typer.echo(f"{out}: {len(files)} schemas, {touched} files written")

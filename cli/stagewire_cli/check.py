"""``stagewire check``: errors in a spec, and changes without evidence."""

from __future__ import annotations

import difflib
import gc
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.errors import OK, WRONG, CalledWronglyError
from stagewire_cli.generator import compared_spec, find, folder, generator_extra, load, located
from stagewire_cli.output import check_output, output
from stagewire_cli.reports import Report, ReportFormat, summary, written

if TYPE_CHECKING:
    from stagewire_generator.pipeline import Checked


EXAMPLE = """\b
Examples:
  stagewire check spec
  stagewire check spec --against origin/main --format github
  stagewire check --explain SW031
"""


def _explain(code: str | None) -> None:
    """Print the explanation of a code, and exit."""
    if code is None:
        return
    with generator_extra():
        from stagewire_generator.codes import CODES
        from stagewire_generator.codes_page import anchor
    name = code.upper()
    if name not in CODES:
        near = " or ".join(difflib.get_close_matches(name, CODES))
        known = f"did you mean {near}?" if near else f"codes are {min(CODES)} to {max(CODES)}"
        raise CalledWronglyError(f"unknown code {code}; {known}")
    found = CODES[name]
    typer.echo(f"{name}: {found.title}\ncause: {found.cause}\ncure: {found.hint}\n{anchor(name)}")
    raise typer.Exit(OK)


def check(
    spec: Annotated[
        Path,
        typer.Argument(parser=folder, metavar="SPEC", help="Folder of one or more protocols."),
    ] = Path("spec"),
    against: Annotated[
        str | None,
        typer.Option(
            "--against",
            metavar="REV",
            help="Require evidence for every change on the wire since this folder or git revision.",
        ),
    ] = None,
    overlay: Annotated[
        list[str] | None,
        typer.Option(
            "--overlay",
            metavar="PROTOCOL/OVERLAY",
            help="Also check these overlays, applied in this order after the default ones; may be "
            "repeated. Each overlay is always checked on what it builds on. Not with --against.",
        ),
    ] = None,
    base: Annotated[
        bool,
        typer.Option(
            "--base", help="Leave out the overlays that are on by default from the combination."
        ),
    ] = False,
    format: Annotated[
        ReportFormat,
        typer.Option(
            "--format",
            case_sensitive=False,
            help="Format of the report, for people, programs or CI servers.",
        ),
    ] = ReportFormat.TEXT,
    out: Annotated[
        Path | None,
        typer.Option("--output", metavar="FILE", help="Write the report to a file."),
    ] = None,
    _: Annotated[
        str | None,
        typer.Option(
            "--explain",
            metavar="CODE",
            callback=_explain,
            is_eager=True,
            help="Print the cause and cure of a diagnostic, such as SW031, and exit.",
        ),
    ] = None,
) -> None:
    """Check a spec and report all errors in it.

    With --against, every change on the wire in a protocol or an overlay needs an erratum or a reference
    to the document. If REV is a revision, SPEC is compared with the same folder in that revision.
    """
    with generator_extra():
        from stagewire_generator.diagnostics import SpecError

        if format is ReportFormat.JUNIT:
            import junitparser  # noqa: F401
    if against is not None and overlay:
        raise CalledWronglyError(
            "--against compares each overlay on its own, so it cannot be combined with --overlay"
        )
    if out is not None:
        check_output(out, None)
    gc.disable()  # as in `generate`: nearly all objects live until the end
    [found] = find([spec])
    try:
        loaded = load([found], overlay or [], base=base)
        report = Report(found, counts=loaded.counts)
    except SpecError as error:
        report = Report(found, error.diagnostics)
    else:
        if against is not None:
            report = _compared(report, loaded.checked, against, format)
    _show(report, format, out)
    if report.diagnostics:
        raise typer.Exit(WRONG)


def _compared(
    report: Report, checked: Mapping[str, Checked], against: str, format: ReportFormat
) -> Report:
    """Return the report with the changes, and with diagnostics for wire changes without evidence."""
    from stagewire_generator.change import Spec, compare_specs, unvouched
    from stagewire_generator.change.changes import counts

    quiet = format is not ReportFormat.TEXT
    new = Spec.of(checked)
    with compared_spec("--against", against, str(report.spec.path), quiet=quiet) as old:
        changes = compare_specs(old, new)
        found = located(unvouched(changes, old, new), report.spec)
    numbers = {level.name: number for level, number in counts(changes).items()}
    return replace(report, diagnostics=found, against=against, changes=numbers)


def _show(report: Report, format: ReportFormat, out: Path | None) -> None:
    """Write the report, and a summary to standard error unless the report contains it."""
    with output(out) as stream:
        stream.write(written(report, format))
    if report.diagnostics or format is not ReportFormat.TEXT:
        typer.echo(summary(report), nl=False, err=True)

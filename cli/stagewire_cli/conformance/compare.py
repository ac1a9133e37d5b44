"""``stagewire conformance compare``: the changes between two JSON reports."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.output import printable
from stagewire_conformance.reports.changes import changes_as_json, changes_as_text
from stagewire_conformance.reports.changes import compare as compare_runs
from stagewire_conformance.reports.json_reader import ReportFileError, read_run

EXAMPLE = """\b
Examples:
  stagewire conformance compare firmware-1.2.json firmware-1.3.json
  stagewire conformance compare old.json new.json --json > changes.json
\b
Exit status:
  0  nothing became worse
  1  a result became worse, a case that passed is no longer run, or the run is no longer complete
  2  invalid arguments, or a file that is not a JSON report
"""


def compare(
    old: Annotated[Path, typer.Argument(metavar="OLD.json", help="The earlier report.")],
    new: Annotated[Path, typer.Argument(metavar="NEW.json", help="The later report.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show the changes between two reports, such as those of two firmware versions.

    The reports are those that --json of conformance device or codec writes. The command compares results,
    findings, broken rules, completeness, and facts about the implementation. Findings are compared without
    their numbers, because times and positions differ in every run.
    """
    try:
        changes = compare_runs(read_run(old), read_run(new))
    except ReportFileError as error:
        raise CalledWronglyError(str(error)) from None
    if as_json:
        typer.echo(changes_as_json(changes), nl=False)
    else:
        for line in changes_as_text(changes):
            typer.echo(printable(line))
    if changes.worse:
        raise typer.Exit(WRONG)

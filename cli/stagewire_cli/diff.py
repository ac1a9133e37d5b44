"""``stagewire diff``: the changes between two specs, by class."""

from __future__ import annotations

import enum
import json
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.generator import compared_spec, generator_extra
from stagewire_cli.output import printable

if TYPE_CHECKING:
    from stagewire_generator.change import Change


EXAMPLE = """\b
Examples:
  stagewire diff HEAD~1 spec
  stagewire diff v1.0 v1.1 --fail-on wire
  stagewire diff old/spec new/spec --json
"""

_MEANING = {
    "WIRE": "bytes change or become ambiguous",
    "SOURCE": "generated names or types change",
    "DOC": "texts, pages, errata, examples",
}
_LONGEST = 60  # characters shown of a value
_BEFORE = 20  # characters shown before the first difference


class Severity(enum.StrEnum):
    """Values of ``--fail-on``: the classes of changes."""

    WIRE = "wire"
    SOURCE = "source"
    DOC = "doc"


def diff(
    old: Annotated[str, typer.Argument(metavar="OLD", help="A folder, or a git revision.")],
    new: Annotated[str, typer.Argument(metavar="NEW", help="A folder, or a git revision.")],
    spec: Annotated[
        str,
        typer.Option(
            "--spec",
            metavar="FOLDER",
            help="Folder of the spec in a revision; REVISION:PATH selects another one.",
        ),
    ] = "spec",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON, in the format of changes.schema.json.")
    ] = False,
    fail_on: Annotated[
        Severity | None,
        typer.Option(
            "--fail-on",
            case_sensitive=False,
            help="Exit with status 1 if there is a change of this class or a more serious one.",
        ),
    ] = None,
) -> None:
    """Show and classify the changes between two specs.

    OLD and NEW are folders that contain protocols, or revisions of the git repository in the current
    folder. Every overlay is also compared, applied to its protocol and the overlays that it builds on. A
    change of the protocol itself is shown only once.
    """
    if not spec.strip():
        raise CalledWronglyError("the folder of --spec is empty")
    with generator_extra():
        from stagewire_generator.change import ChangeClass, compare_specs, worst
        from stagewire_generator.change.changes import report
    with compared_spec("OLD", old, spec) as before, compared_spec("NEW", new, spec) as after:
        changes = compare_specs(before, after)
    if as_json:
        typer.echo(json.dumps(report(old, new, changes), indent=2, ensure_ascii=False))
    else:
        _show(changes)
    gravest = worst(changes)
    if fail_on is not None and gravest is not None and gravest >= ChangeClass[fail_on.name]:
        raise typer.Exit(WRONG)


def _show(changes: Sequence[Change]) -> None:
    """Print the changes by class and subject, one line each."""
    from stagewire_generator.change.changes import counts

    several = len({change.title for change in changes} | {c.protocol for c in changes}) > 1
    for level, alike in groupby(changes, key=lambda change: change.level):
        typer.echo(f"{level.name}: {_MEANING[level.name]}")
        for head, group in groupby(alike, key=lambda change: _head(change, several)):
            typer.echo(f"  {printable(head)}")
            for change in group:
                typer.echo(f"    {printable(_line(change))}")
    total = len(changes)
    if not total:
        typer.echo("no changes")
        return
    listed = ", ".join(f"{number} {level.name}" for level, number in counts(changes).items())
    typer.echo(f"{total} change{'s' * (total != 1)}: {listed}")


def _head(change: Change, several: bool) -> str:
    """Return the subject of a change: ``message POS_MOVE``."""
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    if noun == "attribute" or (noun == "overlay" and change.overlay):
        return f"{'overlay' if change.overlay else 'protocol'} {change.title}"
    head = f"{noun} {name}"
    return f"{change.title}: {head}" if several else head


def _line(change: Change) -> str:
    """Return the kind of a change, the rest of its path, its values and its meaning."""
    names = list(change.where.values())
    head = 0 if "attribute" in list(change.where)[:1] else 1
    path = " ".join(names[head:])
    words = [path] if path else []
    if {change.old, change.new} - {None} - set(names[-1:]):
        old, new = _cut(change.old or "-", change.new or "-")
        words.append(f"{old} -> {new}")
    line = f"{change.kind}: {' '.join(words)}" if words else change.kind
    return line if change.level.name == "DOC" else f"{line}; {change.text}"


def _cut(old: str, new: str) -> tuple[str, str]:
    """Return two texts short enough for a line that still show the first difference."""
    if max(len(old), len(new)) <= _LONGEST:
        return old, new
    same = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
    start = max(0, same - _BEFORE)
    return _piece(old, start), _piece(new, start)


def _piece(text: str, start: int) -> str:
    if len(text) <= _LONGEST:
        return text
    end = start + _LONGEST
    return f"{'…' if start else ''}{text[start:end]}{'…' if end < len(text) else ''}"

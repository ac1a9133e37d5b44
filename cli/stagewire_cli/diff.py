"""``stagewire diff``: what changed between two specs, and how grave it is."""

from __future__ import annotations

import enum
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.errors import CALLED_WRONGLY, WRONG, CalledWronglyError
from stagewire_cli.generator import load, show_diagnostics, the_generator
from stagewire_cli.terminal import printable

if TYPE_CHECKING:
    from stagewire_generator.change import Change, Revision
    from stagewire_generator.model import Protocol

__all__ = ["EXAMPLE", "diff"]

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
_LONGEST = 60  # characters of a value on a line
_BEFORE = 20  # characters of them before the first that differs


class Grave(enum.StrEnum):
    """The classes of changes, as the option spells them."""

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
            help="Folder of the spec in a revision; REVISION:path names another.",
        ),
    ] = "spec",
    as_json: Annotated[bool, typer.Option("--json", help="As changes.schema.json says.")] = False,
    fail_on: Annotated[
        Grave | None,
        typer.Option(
            "--fail-on",
            case_sensitive=False,
            help="Exit with 1 if there is a change of this class or a graver one.",
        ),
    ] = None,
) -> None:
    """Show what changed between two specs: on the wire, in generated source, in the documentation.

    OLD and NEW are folders that hold protocols, or revisions of the git repository of the current folder.
    """
    if not spec.strip():
        raise CalledWronglyError("the name of the folder after --spec is empty")
    with the_generator():
        from stagewire_generator.change import ChangeClass, compare, report, worst
    with _side("OLD", old, spec) as before, _side("NEW", new, spec) as after:
        changes = compare(before, after)
    if as_json:
        typer.echo(json.dumps(report(old, new, changes), indent=2, ensure_ascii=False))
    else:
        _show(changes)
    gravest = worst(changes)
    if fail_on is not None and gravest is not None and gravest >= ChangeClass[fail_on.name]:
        raise typer.Exit(WRONG)


@contextmanager
def _side(side: str, name: str, spec: str) -> Iterator[list[Protocol]]:
    """Give the protocols of a folder or revision; show why they cannot be had, and end with 2."""
    from stagewire_generator.change import RevisionError, revision

    if not name.strip():
        raise CalledWronglyError(f"the name of {side} is empty; give a folder or a revision")
    if Path(name).is_dir():
        yield _load(side, name, Path(name))
        return
    try:
        with revision(name, spec) as extracted:
            yield _load(side, name, extracted.spec, extracted)
    except RevisionError as error:
        raise CalledWronglyError(
            f"{side}, {name}, is no folder, and as a revision it cannot be read: {error}"
        ) from None


def _load(side: str, name: str, folder: Path, extracted: Revision | None = None) -> list[Protocol]:
    from stagewire_generator.diagnostics import SpecError

    try:
        return load([folder])[0]
    except SpecError as error:
        found = error.diagnostics
        if extracted is not None:
            found = [extracted.named(diagnostic) for diagnostic in found]
        show_diagnostics(SpecError(found), [Path(name)])
        typer.echo(f"{side} does not pass check, so that nothing was compared", err=True)
        if extracted is not None:
            typer.echo(
                "it was checked by the rules of this stagewire; for a spec that was written for "
                "another one, compare with the stagewire of its time",
                err=True,
            )
        raise typer.Exit(CALLED_WRONGLY) from None


def _show(changes: Sequence[Change]) -> None:
    """Print the changes by class, then by what they are about; one line each."""
    from stagewire_generator.change.report import counts

    several = len({change.protocol for change in changes}) > 1
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
    """Return what a change is about, from the outside: ``message POS_MOVE``."""
    noun, name = next(iter(change.where.items()), ("attribute", ""))
    head = f"protocol {change.protocol}" if noun == "attribute" else f"{noun} {name}"
    return f"{change.protocol}: {head}" if several and noun != "attribute" else head


def _line(change: Change) -> str:
    """Return the kind, the rest of the place, the values unless the place says them, the meaning."""
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
    """Return two texts short enough for a line, such that where they differ is still to be seen."""
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

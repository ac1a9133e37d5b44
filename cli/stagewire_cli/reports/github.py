"""For GitHub Actions: a workflow command for each diagnostic, which becomes a note beside the line."""

from __future__ import annotations

import os
from pathlib import Path

from stagewire_cli.reports.report import Report
from stagewire_cli.terminal import printable

__all__ = ["as_github"]

_IN_A_MESSAGE = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_IN_A_PROPERTY = {**_IN_A_MESSAGE, ":": "%3A", ",": "%2C"}


def as_github(report: Report) -> str:
    """Return one line for each diagnostic; nothing when all is right."""
    from stagewire_generator.codes import CODES

    lines = []
    for diagnostic in report.diagnostics:
        place = diagnostic.place
        properties = {
            "file": _from_the_top(Path(os.path.abspath(place.file))),
            "line": str(place.line),
            "col": str(place.column),
            "title": f"{diagnostic.code}: {CODES[diagnostic.code].title}",
        }
        listed = ",".join(
            f"{name}={_escaped(printable(value), _IN_A_PROPERTY)}"
            for name, value in properties.items()
        )
        said = f"{printable(diagnostic.message)}\nhint: {printable(diagnostic.cure)}"
        lines.append(f"::error {listed}::{_escaped(said, _IN_A_MESSAGE)}\n")
    return "".join(lines)


def _from_the_top(path: Path) -> str:
    """Return a path from the top of its git repository, where notes look for it; else as it is."""
    top = next((folder for folder in path.parents if (folder / ".git").exists()), None)
    return (path.relative_to(top) if top else path).as_posix()


def _escaped(text: str, table: dict[str, str]) -> str:
    return "".join(table.get(c, c) for c in text)

"""Report files: options, what is wrong with them before a run, and writing them after it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.errors import OK, WRONG, CalledWronglyError
from stagewire_cli.output import check_output, output

if TYPE_CHECKING:
    from stagewire_conformance.reports import Sheet

__all__ = ["NON_STRICT", "UNFINISHED", "Html", "Json", "Junit", "ReportFiles", "code_of"]

NON_STRICT = 3
"""Nothing failed, but something departs from what a document advises."""
UNFINISHED = 4
"""The run did not come to its end."""

Junit = Annotated[
    Path | None,
    typer.Option("--junit", metavar="FILE", help="Write a report for CI servers (JUnit XML)."),
]
Json = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write a report for programs (JSON).")
]
Html = Annotated[
    Path | None,
    typer.Option("--html", metavar="FILE", help="Write a page to read, print and hand on."),
]

_NEEDED = {"--junit": "junitparser", "--html": "jinja2"}
"""Of an option the module that it needs beyond what is always there."""


def code_of(sheet: Sheet) -> int:
    """Return the exit code of a run: a failure weighs more than an early end, and that more than the rest."""
    from stagewire_conformance.reports import Verdict

    codes = {
        Verdict.PASSED: OK,
        Verdict.FAILED: WRONG,
        Verdict.NON_STRICT: NON_STRICT,
        Verdict.UNFINISHED: UNFINISHED,
    }
    return codes[sheet.verdict]


@dataclass(frozen=True)
class ReportFiles:
    """The files that were asked for.

    :param others: further files of the call, by their options, that must not be written over.
    """

    junit: Path | None = None
    json: Path | None = None
    html: Path | None = None
    others: tuple[tuple[str, Path | None], ...] = ()

    def check(self) -> None:
        """Refuse before a run what could not be written after it.

        Raises :class:`CalledWronglyError` for a file that cannot be made, for one that is named twice, and
        where what writes it is not installed.
        """
        seen: dict[Path, str] = {}
        for option, path in (*self._wanted(), *self.others):
            if path is None:
                continue
            place = Path(os.path.realpath(path))
            if place in seen:
                raise CalledWronglyError(f"{seen[place]} and {option} name the same file, {path}")
            seen[place] = option
        for option, path in self._wanted():
            if path is None:
                continue
            self.check_file(path, option)
            _check_needed(option)

    @staticmethod
    def check_file(path: Path, option: str) -> None:
        """Refuse a file that cannot be made, and ``-``; raises :class:`CalledWronglyError`."""
        if str(path) == "-":
            raise CalledWronglyError(f"{option}: - is no file; give the name of one")
        check_output(path, None, option)

    def write(self, sheet: Sheet) -> list[Path]:
        """Write every report, and return their files; each appears when it is whole.

        Raises :class:`CalledWronglyError` for those that could not be written, after all others were.
        """
        from stagewire_conformance.reports import as_html, as_json, as_junit

        writers = {"--junit": as_junit, "--json": as_json, "--html": as_html}
        written, failed = [], []
        for option, path in self._wanted():
            if path is None:
                continue
            try:
                with output(path) as stream:
                    stream.write(writers[option](sheet))
            except OSError as error:
                failed.append(f"{option} {path} could not be written: {error.strerror or error}")
            else:
                written.append(path)
        if failed:
            raise CalledWronglyError("\n".join(failed))
        return written

    def _wanted(self) -> tuple[tuple[str, Path | None], ...]:
        return (("--junit", self.junit), ("--json", self.json), ("--html", self.html))


def _check_needed(option: str) -> None:
    name = _NEEDED.get(option)
    try:
        import_module(name) if name else None
    except ModuleNotFoundError:
        raise CalledWronglyError(
            f"{option} needs {name}; it comes with pip install 'stagewire[conformance]'"
        ) from None

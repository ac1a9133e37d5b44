"""The results of a program of this folder: one for each expectation.

A program makes a :class:`Results` for its package and checks expectations with it::

    results = Results("thorlabs_xa")
    if results.installed:
        results.check("KDC101", "homes", position == 0, f"position {position}")
        results.known("KST101", "opens", opened, "it requires firmware of major version 2")
    results.finish()

Each program also runs by itself and then prints its own table. ``run.py`` runs all programs.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any


class Verdict(StrEnum):
    """The verdict about an expectation."""

    PASSED = "passed"
    FAILED = "failed"
    """Not as expected. Only this verdict makes a run fail."""
    KNOWN = "known"
    """Does not work, for a reason that the program states."""
    MISSING = "missing"
    """Not tried, because the package is not installed."""


@dataclass(frozen=True)
class Result:
    """The result of one expectation.

    :param package: the third-party package with its version.
    :param subject: the unit or class that was tried.
    :param what: what was expected, such as "homes".
    :param verdict: the verdict.
    :param detail: what was found, or the reason.
    """

    package: str
    subject: str
    what: str
    verdict: Verdict
    detail: str


class Results:
    """The results of a program.

    :param package: the name of the distribution that it needs.
    """

    def __init__(self, package: str) -> None:
        self._results: list[Result] = []
        self.installed = True
        """Whether the package is installed; if it is not, that is the only result."""
        try:
            self._package = f"{package} {importlib.metadata.version(package)}"
        except importlib.metadata.PackageNotFoundError:
            self.installed = False
            self._package = package
            self._add("", "is installed", Verdict.MISSING, "install it into .venv/interop")

    def check(self, subject: str, what: str, passed: bool, detail: str = "") -> None:
        """Record an expectation that must hold."""
        self._add(subject, what, Verdict.PASSED if passed else Verdict.FAILED, detail)

    def known(
        self, subject: str, what: str, passed: bool, reason: str, *, always: bool = True
    ) -> None:
        """Record an expectation that is known not to hold, with the reason.

        It fails if it holds: the reason is then out of date. With ``always=False`` it may hold: it depends
        on time or chance.
        """
        if not passed:
            self._add(subject, what, Verdict.KNOWN, reason)
        elif always:
            self._add(subject, what, Verdict.FAILED, f"works, although: {reason}")
        else:
            self._add(subject, what, Verdict.PASSED, f"this time; at other times: {reason}")

    def call(
        self,
        subject: str,
        what: str,
        function: Callable[[], Any],
        reason: str = "",
        *,
        always: bool = True,
    ) -> Any:
        """Call a function that must not raise, or that is known to raise if there is a reason.

        Return its value, or None if it raised. ``always`` is that of :meth:`known`.
        """
        value, error = None, ""
        try:
            value = function()
        except Exception as raised:
            error = f"{type(raised).__name__}: {raised}"
        if reason:
            self.known(subject, what, not error, reason, always=always)
        else:
            self.check(subject, what, not error, error)
        return value

    def finish(self) -> None:
        """Write the results to the file of ``--results``, or print them, and end the program."""
        parser = argparse.ArgumentParser()
        parser.add_argument("--results", type=Path)
        file = parser.parse_known_args()[0].results
        if file is None:
            sys.exit(show(self._results))
        write(file, self._results)
        sys.exit(0)

    def _add(self, subject: str, what: str, verdict: Verdict, detail: str) -> None:
        self._results.append(Result(self._package, subject, what, verdict, detail))


def write(file: Path, results: Sequence[Result]) -> None:
    """Write results to a file, for :func:`read`."""
    file.write_text(json.dumps([asdict(result) for result in results]), encoding="utf-8")


def read(file: Path) -> list[Result]:
    """Read the results of a program."""
    found = json.loads(file.read_text(encoding="utf-8"))
    return [Result(**{**entry, "verdict": Verdict(entry["verdict"])}) for entry in found]


def show(results: Sequence[Result]) -> int:
    """Print the table of results and their number by verdict; return the exit status."""
    rows = [(each.verdict, each.package, each.subject, each.what, each.detail) for each in results]
    head = ("verdict", "package", "subject", "expected", "found")
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print("  ".join(cells).rstrip())
    numbers = Counter(each.verdict for each in results)
    print(", ".join(f"{numbers[verdict]} {verdict}" for verdict in Verdict))
    return 1 if numbers[Verdict.FAILED] else 0

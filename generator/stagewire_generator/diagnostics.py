"""Diagnostics: the errors in a spec, with their position and a hint.

A run collects all diagnostics before it stops. Each has a stable code, which the table in ``codes`` explains
for the messages and the documentation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches

from stagewire_generator.codes import CODES

MOST_OF_A_FILE = 1000
"""Maximum number of diagnostics reported for one file."""


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A position in a file; line and column are counted from 1."""

    file: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True, order=True)
class Diagnostic:
    """One error in a spec."""

    place: Place
    code: str
    message: str
    hint: str = ""

    @property
    def cure(self) -> str:
        """How to fix it: the hint of this diagnostic, or else of its code."""
        return self.hint or CODES[self.code].hint

    def __str__(self) -> str:
        what, hint = f"{self.place}: {self.code} {self.message}", f"    hint: {self.cure}"
        return f"{_shown(what)}\n{_shown(hint)}"


def _shown(text: str) -> str:
    """Escape characters that could control a terminal: file names and keys come from the spec."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def meant(name: str, known: Iterable[str]) -> str:
    """Return the hint for an unknown name: the known names that resemble it; empty if none does."""
    close = get_close_matches(name[:80], list(known), cutoff=0.5)
    return f"did you mean {' or '.join(close)}?" if close else ""


class SpecError(Exception):
    """A spec has errors; holds all diagnostics of the run."""

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        self.diagnostics = diagnostics
        super().__init__(f"{len(diagnostics)} error(s) in the spec")


@dataclass(slots=True)
class Diagnostics:
    """The diagnostics of one run.

    :param found: the diagnostics, each once.
    :param reported: how many were reported. An error of a protocol is reported again for each overlay, so
        only this number shows whether a check reported one.
    """

    found: list[Diagnostic] = field(default_factory=list)
    reported: int = 0
    _noted: set[Diagnostic] = field(default_factory=set)
    _of_files: Counter[str] = field(default_factory=Counter)

    def add(self, place: Place, code: str, message: str, hint: str = "") -> None:
        """Add a diagnostic, unless it is a duplicate or its file has reached the limit."""
        self.reported += 1
        diagnostic = Diagnostic(place, code, message, hint)
        if diagnostic in self._noted or self._of_files[place.file] == MOST_OF_A_FILE:
            return
        self._noted.add(diagnostic)
        self._of_files[place.file] += 1
        self.found.append(diagnostic)

    def __bool__(self) -> bool:
        return bool(self.found)

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(sorted(self.found))

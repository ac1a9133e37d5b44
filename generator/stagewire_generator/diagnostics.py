"""Diagnostics: what is wrong in a spec, where, and what to do about it.

A run collects all of them before it stops. Each has a stable code; the table in ``codes`` says what it stands
for once, for the messages and for the documentation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from stagewire_generator.codes import CODES

MOST_OF_A_FILE = 1000
"""Diagnostics that are kept of one file; a reader mends these first."""


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A position in a file; line and column count from one."""

    file: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True, order=True)
class Diagnostic:
    """One thing that is wrong."""

    place: Place
    code: str
    message: str
    hint: str = ""

    @property
    def cure(self) -> str:
        """What to do: the hint of this one, or that of its code."""
        return self.hint or CODES[self.code].hint

    def __str__(self) -> str:
        what, hint = f"{self.place}: {self.code} {self.message}", f"    hint: {self.cure}"
        return f"{_shown(what)}\n{_shown(hint)}"


def _shown(text: str) -> str:
    """Escape what could steer a terminal: names of files and keys come from the spec."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class SpecError(Exception):
    """A spec with errors; carries all diagnostics of the run."""

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        self.diagnostics = diagnostics
        super().__init__(f"{len(diagnostics)} error(s) in the spec")


@dataclass(slots=True)
class Diagnostics:
    """Collects the diagnostics of one run."""

    found: list[Diagnostic] = field(default_factory=list)
    _noted: set[Diagnostic] = field(default_factory=set)
    _of_files: Counter[str] = field(default_factory=Counter)

    def add(self, place: Place, code: str, message: str, hint: str = "") -> None:
        """Note one more; the same one is noted once, and of a file only so many."""
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

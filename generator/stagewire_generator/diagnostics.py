"""Diagnostics: what is wrong in a spec, where, and what to do about it.

A run collects all of them before it stops. Each has a stable code; the table below gives its title and
its hint once, for the messages and for the documentation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

__all__ = ["CODES", "MOST_OF_A_FILE", "Code", "Diagnostic", "Diagnostics", "Place", "SpecError"]

MOST_OF_A_FILE = 1000
"""Diagnostics that are kept of one file; a reader mends these first."""


@dataclass(frozen=True, slots=True)
class Code:
    """What a diagnostic code stands for, and the cure."""

    title: str
    hint: str


CODES: dict[str, Code] = {
    # Files
    "SW001": Code("not readable YAML", "mend the syntax at the place that is named"),
    "SW002": Code("duplicate key", "keep one of the two entries"),
    "SW003": Code("anchors, aliases, merge keys and tags are not used", "write the fact out"),
    "SW004": Code("a plain word that YAML readers take for different things", "put it in quotes"),
    "SW005": Code("a key that is not text", "write a name, or put it in quotes"),
    "SW006": Code("a file is missing or not UTF-8 text", "add the file, or save it as UTF-8"),
    "SW007": Code("a control or invisible character in a text", "remove the character"),
    "SW008": Code(
        "a file that is not read: a link out of the spec, too large, or no regular file",
        "put a text file of at most 1 MiB there",
    ),
    "SW010": Code("not as the schema says", "see the schema that the first line of the file names"),
    # Names and references
    "SW020": Code("the same name twice", "names are unique in a protocol; rename or remove one"),
    "SW021": Code("a name that nothing defines", "correct the spelling, or define it"),
    "SW022": Code("names that cannot be told apart in generated code", "rename one of them"),
    "SW023": Code("a name that a generated language keeps for itself", "choose another name"),
    "SW024": Code(
        "a spelling that does not spell the name", "the words, joined, must give the name"
    ),
    # Layouts
    "SW030": Code("two messages with one id", "one of the ids is wrong; see the document"),
    "SW031": Code("the length is not the sum of the fields", "correct the length or the fields"),
    "SW032": Code("layouts that neither bytes nor context tell apart", "give each a `when`"),
    "SW033": Code(
        "a range or value that the format cannot hold", "correct the range or the format"
    ),
    "SW034": Code("an enumeration or flag value twice", "each value has one name"),
    "SW035": Code("an exchange that does not fit", "a REQ is answered by a message to the host"),
    "SW036": Code("a message without id or layout and without an erratum", "say so in an erratum"),
    "SW037": Code("a scale that is not an exact positive rational", "write it as N or N/D"),
    "SW038": Code(
        "what the framing of the protocol has no place for",
        "header framing has messages, slots have commands; or correct the byte that is named",
    ),
    "SW039": Code("a page that the document has not", "correct the page, or the number of pages"),
    # The witness, the errata, the examples
    "SW040": Code(
        "the document prints something else than the registry says",
        "look at the page; correct the one that was copied wrongly, or add an erratum with this place",
    ),
    "SW041": Code(
        "an erratum that no difference and no example bears out",
        "name the place of the difference, refer to it from an example, or remove it",
    ),
    "SW042": Code(
        "an erratum names a place where document and registry agree",
        "remove the place from the erratum",
    ),
    "SW043": Code(
        "a message that the witness does not have", "transcribe what the document prints"
    ),
    "SW044": Code("the witness has a message that the registry has not", "add it to the registry"),
    "SW045": Code("a place that two errata claim", "one difference has one erratum"),
}


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

    def __str__(self) -> str:
        hint = self.hint or CODES[self.code].hint
        return f"{_shown(f'{self.place}: {self.code} {self.message}')}\n    hint: {hint}"


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

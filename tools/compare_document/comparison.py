"""The transcription of Issue 37, the differences from the document, and those that were resolved by eye."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import yaml

from compare_document.document import Document

ROOT: Final = Path(__file__).parents[2]
OVERLAY: Final = ROOT / "spec" / "thorlabs_apt" / "overlays" / "issue_37"
BY_EYE: Final = Path(__file__).parent / "read_by_eye.yaml"
NOTHING: Final = "nothing"

Data = Mapping[str, Any]


@dataclass(frozen=True, order=True)
class Difference:
    """A place at which the program reads something else than the transcription has."""

    line: int
    what: str
    read: str
    printed: str


@dataclass(repr=False)
class Transcription:
    """The files of the overlay that transcribe the document."""

    messages: list[tuple[str, Data]]
    lists: Data
    contents: Data
    statements: list[Data]
    examples: Data

    @classmethod
    def load(cls, overlay: Path = OVERLAY) -> Transcription:
        """Read the files of an overlay."""
        files = [load(path) for path in sorted((overlay / "printed").glob("*.yaml"))]
        chapters: dict[str, list[Any]] = {}
        for content in files:
            chapters.setdefault(content["chapter"], []).append(content)
        return cls(
            [item for content in files for item in content.get("messages", {}).items()],
            merged(chapters["lists"]),
            chapters["contents"][0],
            [one for content in chapters["statements"] for one in content["statements"]],
            load(overlay / "examples.yaml")["examples"],
        )


def merged(files: Sequence[Data]) -> Data:
    """Return the files of a chapter as one, with all their lists."""
    found: dict[str, Any] = {}
    for content in files:
        found = {**found, **content, "lists": {**found.get("lists", {}), **content["lists"]}}
    return found


@dataclass(repr=False)
class Comparison:
    """The differences, and how much was compared and found equal, by kind."""

    document: Document
    transcription: Transcription
    differences: list[Difference] = field(default_factory=list)
    read: Counter[str] = field(default_factory=Counter)
    equal: Counter[str] = field(default_factory=Counter)

    def check(self, line: int, what: str, read: object, printed: object) -> None:
        """Compare one place."""
        self.read[what] += 1
        if read == printed:
            self.equal[what] += 1
        else:
            self.differences.append(Difference(line, what, words(read), words(printed)))

    def covers(self, line: int) -> bool:
        """Whether the chapter of a line is transcribed."""
        page = self.document.page(line)
        return any(page in pages for pages in self.transcribed)

    @cached_property
    def transcribed(self) -> list[range]:
        """Return the pages of the chapters with a transcribed message."""
        starts = [pages.start for pages, _ in self.document.chapters()]
        messages = self.transcription.messages
        headings = {entry["heading"]["page"] for _, entry in messages}
        pages = [pages for pages, _ in self.document.chapters() if headings & {*pages}]
        return [range(starts[0]), *pages]

    def check_all(
        self, what: str, read: Mapping[int, object], printed: Mapping[int, object]
    ) -> None:
        """Compare all places of a kind; a place on one side only is a difference."""
        for line in sorted({*read, *printed}):
            self.check(line, what, read.get(line, NOTHING), printed.get(line, NOTHING))


def load(path: Path) -> Any:
    """Read a YAML file."""
    return yaml.load(
        path.read_text(encoding="utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    )


def words(value: object) -> str:
    """Return a value as in ``read_by_eye.yaml``: parts separated by |."""
    if isinstance(value, (tuple, list)):
        return " | ".join(words(part) for part in value)
    return NOTHING if value is None else str(value)


def squash(text: str) -> str:
    """Keep only letters and digits: a name may be split over two lines."""
    return re.sub(r"[^a-z0-9]", "", plain(text).casefold())


def plain(text: str) -> str:
    """Return a text with plain digits and signs instead of superscripts."""
    return unicodedata.normalize("NFKC", text).replace("\N{MINUS SIGN}", "-")


def contains(text: str, parts: Iterable[str]) -> bool:
    """Whether a text of the document has all parts of a transcribed text."""
    return all(squash(part) in squash(text) for part in parts)


def resolve(comparison: Comparison, by_eye: Sequence[Data]) -> list[str]:
    """Return a line for each difference that is not listed, and for each entry without its difference."""
    listed = {Difference(one["line"], one["what"], one["read"], one["printed"]) for one in by_eye}
    found = set(comparison.differences)
    return [
        f"line {one.line}, {one.what}: the text has {one.read!r}, the transcription {one.printed!r}"
        for one in sorted(found - listed)
    ] + [
        f"line {one.line}, {one.what}: the entry of read_by_eye.yaml has no such difference"
        for one in sorted(listed - found)
    ]

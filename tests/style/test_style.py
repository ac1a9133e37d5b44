"""The prose of the project has no phrases that read like a literal translation."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from passages import Passage, docstrings, everything, paragraphs, plain

import plain_yaml

HERE = Path(__file__).parent
OLD = plain_yaml.load((HERE / "old_sentences.yaml").read_text(encoding="utf-8"))

PER_100_000_WORDS = 5
"""Maximum number of hits in 100,000 words of well-written documentation."""

FOUND_OF_OLD = 0.8
"""Share of the old sentences that the patterns must find."""


@dataclass(frozen=True)
class Pattern:
    """A phrase to avoid, with a sentence that contains it and a better sentence."""

    name: str
    pattern: re.Pattern[str]
    bad: str
    good: str
    kinds: frozenset[str]
    under: tuple[str, ...]

    def hits(self, passage: Passage) -> Iterator[str]:
        """Yield each occurrence of the phrase in a passage, with some context."""
        if self.kinds and passage.kind not in self.kinds:
            return
        if self.under and not passage.path.startswith(self.under):
            return
        for found in self.pattern.finditer(passage.text):
            yield passage.text[max(0, found.start() - 50) : found.end() + 30]


def _pattern(entry: dict[str, object]) -> Pattern:
    flags = re.VERBOSE if entry.get("case") else re.VERBOSE | re.IGNORECASE
    kinds, under = entry.get("kinds", []), entry.get("under", [])
    assert isinstance(kinds, list)
    assert isinstance(under, list)
    return Pattern(
        name=str(entry["name"]),
        pattern=re.compile(str(entry["pattern"]), flags),
        bad=str(entry["bad"]),
        good=str(entry["good"]),
        kinds=frozenset(kinds),
        under=tuple(f"{folder}/" for folder in under),
    )


PATTERNS = [
    _pattern(entry)
    for entry in plain_yaml.load((HERE / "patterns.yaml").read_text(encoding="utf-8"))
]


def hits(passages: Iterable[Passage]) -> Iterator[tuple[Passage, str]]:
    """Yield the passage of every hit, and a line that describes the hit."""
    for passage in passages:
        for pattern in PATTERNS:
            for text in pattern.hits(passage):
                yield passage, f"{passage.path}:{passage.line}: {pattern.name}: …{text}…"


@pytest.mark.parametrize("pattern", PATTERNS, ids=lambda pattern: pattern.name)
def test_a_pattern_finds_the_bad_sentence_and_not_the_good_one(pattern: Pattern) -> None:
    path = f"{pattern.under[0] if pattern.under else ''}x"
    kind = min(pattern.kinds, default="prose")
    assert [*pattern.hits(Passage(path, 1, kind, pattern.bad))]
    assert not [line for _, line in hits([Passage(path, 1, kind, pattern.good)])]


def test_no_passage_has_a_phrase_to_avoid() -> None:
    found = [line for _, line in hits(everything())]
    assert not found, "\n".join(found)


def test_old_sentences_are_found() -> None:
    missed = [text for text in OLD if not [*hits([Passage("x", 1, "message", plain(text))])]]
    assert len(OLD) >= 40
    assert len(missed) <= (1 - FOUND_OF_OLD) * len(OLD), missed


@pytest.mark.matrix
def test_well_written_documentation_has_few_hits() -> None:
    passages = [passage for path in _foreign() for passage in _docstrings(path)]
    words = sum(passage.words for passage in passages)
    found = [line for _, line in hits(passages)]
    assert words > 300_000
    assert len(found) * 100_000 <= PER_100_000_WORDS * words, "\n".join(found)


def _foreign() -> Iterator[Path]:
    """Yield the modules of the standard library, NumPy and hypothesis."""
    library = Path(ast.__file__).parent
    for path in library.rglob("*.py"):
        folders = set(path.relative_to(library).parts)
        if not folders & {"site-packages", "test", "tests", "idlelib", "lib2to3"}:
            yield path
    for name in ("numpy", "hypothesis"):
        file = importlib.import_module(name).__file__
        assert file
        yield from Path(file).parent.rglob("*.py")


def _docstrings(path: Path) -> Iterator[Passage]:
    try:
        found = [*docstrings(path.read_text(encoding="utf-8"))]
    except (SyntaxError, UnicodeDecodeError):  # test data
        return
    for line, text in found:
        for at, paragraph in paragraphs(line, text):
            if not paragraph.lstrip().startswith((">>> ", ".. ")):
                yield Passage(str(path), at, "docstring", plain(paragraph))

"""Long runs of words that a file of the repository shares with a vendor's document.

Facts may be taken from a document, sentences may not: no file may have ten consecutive words of one. Case,
punctuation, markup and line ends do not matter. Numbers and identifiers count, but a run is only reported if
at least six of ten are plain words; the others are rows of bytes. ``shared_names.yaml`` lists, with reasons,
the tables of names that remain.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import plain_yaml
from checkout import ROOT

from . import flow, text

LENGTH = 10
PLAIN = 6
EXCEPTIONS = Path(__file__).parent / "shared_names.yaml"
ESCAPES = re.compile(r"\\(?:u[0-9a-fA-F]{4}|x[0-9a-fA-F]{2}|[nrt])|</?[a-z]+>")
TOKEN = re.compile(r"[^\W_]+(?:_\w+)*")
WORD = re.compile(r"[a-zµμ]{2,}")
Grams = dict[tuple[str, ...], str]


@dataclass(frozen=True)
class Run:
    path: str
    line: int
    document: str
    words: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.document}: {self.words}"


def tokens(content: str) -> list[str]:
    """Return the words, numbers and names of a text, in lower case."""
    return TOKEN.findall(ESCAPES.sub(" ", content).lower())


def grams(words: list[str]) -> Iterator[tuple[str, ...]]:
    return zip(*(islice(words, start, None) for start in range(LENGTH)), strict=False)


def is_prose(gram: Iterable[str]) -> bool:
    return sum(WORD.fullmatch(word) is not None for word in gram) >= PLAIN


def readings(path: Path, protocol: str) -> Iterator[str]:
    """Yield a document as its lines follow each other and, if it has tables, cell by cell."""
    content = path.read_text(encoding="utf-8")
    yield flow.plain(content)
    if protocol in text.NAMES:
        pieces = flow.pieces(text.Document.read(path))
        yield " ".join(flow.plain(piece.text) for piece in pieces)


def of_documents(documents: dict[str, Path]) -> Grams:
    """Return every ten consecutive words of the documents."""
    found: Grams = {}
    for name, path in documents.items():
        for content in readings(path, name):
            for gram in grams(tokens(content)):
                if is_prose(gram):
                    found.setdefault(gram, name)
    return found


def in_text(path: str, content: str, known: Grams) -> Iterator[Run]:
    """Yield the longest runs of words that a text shares with the documents."""
    if known.keys().isdisjoint(grams(tokens(content))):
        return
    spaced = ESCAPES.sub(lambda match: " " * len(match.group()), content)
    places = [(match.group().lower(), match.start()) for match in TOKEN.finditer(spaced)]
    words = [word for word, _ in places]
    start = end = 0
    named = ""
    for number, gram in enumerate(grams(words)):
        if gram not in known:
            continue
        if number >= end:
            if end:
                yield _run(path, content, places, start, end, named)
            start, named = number, known[gram]
        end = number + LENGTH
    if end:
        yield _run(path, content, places, start, end, named)


def _run(
    path: str, content: str, places: list[tuple[str, int]], start: int, end: int, named: str
) -> Run:
    line = content.count("\n", 0, places[start][1]) + 1
    return Run(path, line, named, " ".join(word for word, _ in places[start:end]))


def tracked() -> Iterator[tuple[str, str]]:
    """Yield the path and the content of every text file that git tracks."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, check=True
    ).stdout.decode()
    for path in filter(None, listed.split("\0")):
        try:
            yield path, (ROOT / path).read_text(encoding="utf-8")
        except (UnicodeDecodeError, FileNotFoundError, IsADirectoryError):
            continue  # binary, or removed in the work tree


def in_repository(known: Grams | None = None) -> list[Run]:
    """Return all shared runs in the repository, those of ``shared_names.yaml`` included."""
    known = of_documents(available()) if known is None else known
    return [run for path, content in tracked() for run in in_text(path, content, known)]


def available() -> dict[str, Path]:
    """Return the paths of the available documents."""
    paths = {name: text.find(name) for name in (*text.NAMES, *text.OTHERS)}
    return {name: path for name, path in paths.items() if path is not None}


def is_listed(run: Run) -> list[str]:
    """Return the beginnings in ``shared_names.yaml`` that explain a run."""
    return [
        words
        for entry in exceptions()
        if entry["path"] == run.path
        for words in entry["begins"]
        if run.words.startswith(words)
    ]


@cache
def exceptions() -> list[dict[str, Any]]:
    content: dict[str, list[dict[str, Any]]] = plain_yaml.load(
        EXCEPTIONS.read_text(encoding="utf-8")
    )
    return content["runs"]

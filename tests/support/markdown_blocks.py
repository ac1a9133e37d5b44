"""The fenced code blocks of Markdown documents."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.M | re.S)
_FILE = re.compile(r"(?P<how>File|In) `(?P<path>[^`]+)`")
_SECTION = re.compile(r"^## (.*)$", re.M)
_PRINTED = re.compile(r"print\(.*\) +# (.*)$", re.M)


@dataclass(frozen=True)
class Block:
    """A fenced block: its section and line, its language and text, and optionally its file.

    After a paragraph that starts with "File" and a path in backticks, the next block is the content of that
    file. After "In" and a path, the block is appended to the file. After the paragraph ``<!-- goes on -->``,
    a block continues the block before it.
    """

    section: str
    line: int
    language: str
    text: str
    path: str | None = None
    added: bool = False
    goes_on: bool = False

    @property
    def first(self) -> str:
        """The first line without its comment, which identifies the block."""
        return re.sub(r"\s{2,}#.*", "", self.text.partition("\n")[0])


def blocks(document: Path, language: str | None = None) -> Iterator[Block]:
    """Yield the blocks of a document in order, or only those in one language."""
    page = document.read_text(encoding="utf-8")
    end = 0
    for found in _BLOCK.finditer(page):
        paragraph = page[end : found.start()].strip().split("\n\n")[-1]
        file = _FILE.match(paragraph)
        end = found.end()
        if language in (None, found["language"]):
            yield Block(
                section=(_SECTION.findall(page[: found.start()]) or [""])[-1],
                line=page.count("\n", 0, found.start()) + 1,
                language=found["language"],
                text=found["text"],
                path=file and file["path"],
                added=file is not None and file["how"] == "In",
                goes_on=paragraph == "<!-- goes on -->",
            )


def said(block: Block) -> list[str]:
    """Return the output that a Python block shows in the comments after ``print`` calls."""
    return _PRINTED.findall(block.text)

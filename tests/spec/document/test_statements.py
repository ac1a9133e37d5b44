"""The document has the words of each statement, at the line that the statement names."""

from __future__ import annotations

import re
from typing import Any

import pytest

from . import runs
from .conftest import document, witness
from .text import Document

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
LINES = 3  # lines with text in which the words must end


def squeezed(text: str) -> str:
    """Return a text with single blanks, without the escapes and emphasis of the text of the document."""
    return " ".join(re.sub(r"\\(?=_)|\*\*", "", text).split())


def passage(read: Document, line: int) -> tuple[str, int]:
    """Return some lines with text from a line on, and the length of the first."""
    lines = [squeezed(read[line])]
    for number in range(line + 1, len(read.lines) + 1):
        if len(lines) == LINES:
            break
        if text := squeezed(read[number]):
            lines.append(text)
    return " ".join(lines), len(lines[0])


def problem(read: Document, statement: dict[str, Any]) -> str:
    """Return what is wrong with the words of a statement; empty if nothing is."""
    words = squeezed(statement["words"])
    text, first = passage(read, statement["line"])
    found = re.search(rf"(?<!\w){re.escape(words)}(?!\w)", text)
    if not found or found.start() >= first:
        return f"{words!r} does not begin in this line"
    if len(runs.tokens(words)) >= runs.LENGTH:
        return f"{words!r} has {runs.LENGTH} or more words"
    return ""


@pytest.fixture(scope="module", params=PROTOCOLS)
def protocol(request: pytest.FixtureRequest) -> Any:
    return request.param


def test_words_are_at_their_lines(protocol: str) -> None:
    read = document(protocol)
    files = {
        name: content["statements"]
        for name, content in witness(protocol).items()
        if content["chapter"] == "statements"
    }
    if not files:
        pytest.skip("the protocol has no statements")
    wrong = [
        f"{name}.yaml, line {statement['line']} of the document: {what}"
        for name, statements in files.items()
        for statement in statements
        if (what := problem(read, statement))
    ]
    assert wrong == []
    assert all(statements for statements in files.values())


def test_lines_are_in_order(protocol: str) -> None:
    for name, content in witness(protocol).items():
        lines = [statement["line"] for statement in content.get("statements", ())]
        assert lines == sorted(lines), f"{name}.yaml is not in the order of the document"


def test_misplaced_words_are_found() -> None:
    read = Document(["# A\\_B", "", "one **two**\tthree", "", "four"])
    assert problem(read, {"line": 3, "words": "two three four"}) == ""
    assert problem(read, {"line": 1, "words": "A_B one"}) == ""
    assert problem(read, {"line": 1, "words": "one two"}) != ""
    assert problem(read, {"line": 3, "words": "three two"}) != ""
    assert problem(read, {"line": 3, "words": "ne two"}) != ""
    assert "10 or more words" in problem(Document(["a " * 10]), {"line": 1, "words": "a " * 10})

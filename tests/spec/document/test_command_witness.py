"""The transcription of the command document agrees with the program's reading, fact by fact."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import pytest

from . import extract_commands
from .text import Document

Counts = Counter[str]
Data = Mapping[str, Any]

CHAPTERS = {
    "document": extract_commands.document_chapter,
    "setup": extract_commands.setup_chapter,
    "format": extract_commands.format_chapter,
}


def facts(node: Any) -> int:
    """Count the texts and numbers of a part of the witness."""
    if isinstance(node, dict):
        return sum(map(facts, node.values()))
    return sum(map(facts, node)) if isinstance(node, list) else 1


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_chapters(
    command_document: Document, printed_commands: Data, chapter: str, compared: Counts
) -> None:
    expected = {k: v for k, v in printed_commands[chapter].items() if k != "vocabulary"}
    assert CHAPTERS[chapter](command_document) == expected
    compared[f"facts of the chapter {chapter}"] = facts(expected)


def test_headings(command_document: Document, printed_commands: Data, compared: Counts) -> None:
    found = extract_commands.commands(command_document)
    expected = printed_commands["commands"]["commands"]
    assert [(c["line"], c["title"]) for c in found] == [(c["line"], c["title"]) for c in expected]
    compared["headings of commands"] = len(expected)


def test_commands(command_document: Document, printed_commands: Data, compared: Counts) -> None:
    expected = {entry["title"]: entry for entry in printed_commands["commands"]["commands"]}
    for entry in extract_commands.commands(command_document):
        assert entry == expected[entry["title"]]
        for key, rows in entry.items():
            compared[f"facts of commands: {key}"] += facts(rows)


def test_mentions(command_document: Document, printed_commands: Data, compared: Counts) -> None:
    expected = printed_commands["commands"]["mentions"]
    assert extract_commands.mentions(command_document) == expected
    compared["commands mentioned in other places"] = len(expected)


def test_wording(command_document: Document, printed_commands: Data, compared: Counts) -> None:
    """The words are in their lines, and only the listed sentences are torn."""
    words = printed_commands["wording"]["words"]
    rows = [tuple(row) for listed in words.values() for row in listed]
    assert [(line, text) for line, text in rows if text not in command_document[line]] == []
    parts = extract_commands.paragraphs(command_document, 1, command_document.numbers()[-1])
    torn = [line for part in parts for _, line in part.starts[:-1]]
    assert [line for line, _ in words["torn"]] == torn
    assert all(command_document[line].endswith(text) for line, text in words["torn"])
    compared["words that contradict others, or are damaged"] = len(rows)


def test_spelling(command_document: Document, printed_commands: Data) -> None:
    """Every line with the most frequent misspelling is listed."""
    listed = {
        line
        for line, text in printed_commands["wording"]["words"]["spelling"]
        if text == "compliment"
    }
    assert listed == {n for n in command_document.numbers() if "compliment" in command_document[n]}


def test_every_number_in_a_table(command_document: Document, printed_commands: Data) -> None:
    """A line with a tab is a row of a table; every such line of the document is transcribed."""
    rows = {n for n in command_document.numbers() if "\t" in command_document[n]}
    notation = range(53, 58)  # the notation of numbers and keys in the document
    headings = {11, 26}
    chapters = [printed_commands[name] for name in (*CHAPTERS, "commands")]
    assert rows - lines(chapters) == {*notation, *headings}


def lines(node: Any) -> set[int]:
    """Return every line that the witness names."""
    if isinstance(node, dict):
        here = {node["line"]} if "line" in node else set()
        return here.union(*map(lines, node.values()))
    if isinstance(node, list):
        here = {node[0]} if node and isinstance(node[0], int) else set()
        return here.union(*map(lines, node))
    return set()

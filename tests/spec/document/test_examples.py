"""examples.yaml has every line of bytes in the document, and the three lost lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from .extract import Reading

KINDS = ("tx", "rx", "lost")


def chosen(examples: Mapping[str, Any]) -> dict[int, Mapping[str, Any]]:
    entries = [entry for entry in examples.values() if entry["kind"] in KINDS]
    found = {entry["line"]: entry for entry in entries}
    assert len(found) == len(entries), "two examples have the same line"
    return found


def test_lines(reading: Reading, examples: Mapping[str, Any], compared: Counter[str]) -> None:
    found = {example.line: example.kind for example in reading.examples}
    assert found == {line: entry["kind"] for line, entry in chosen(examples).items()}
    assert Counter(found.values())["lost"] == 3
    for kind in KINDS:
        compared[f"examples: {kind}"] = Counter(found.values())[kind]


def test_lines_per_page(reading: Reading, examples: Mapping[str, Any]) -> None:
    document = reading.document
    expected: dict[int, set[int]] = {}
    for line, entry in chosen(examples).items():
        expected.setdefault(entry["page"], set()).add(line)
    for page, lines in expected.items():
        on_page = {
            example.line
            for example in reading.examples
            if document.pages(example.line)[0] <= page <= document.pages(example.line)[1]
        }
        surely = {line for line in on_page if document.sure(line)}
        assert surely <= lines <= on_page, page


def test_bytes(reading: Reading, examples: Mapping[str, Any], compared: Counter[str]) -> None:
    elided = {place.line for place in reading.unreadable if place.what == "bytes"}
    expected = chosen(examples)
    wrong = []
    for example in reading.examples:
        if example.kind == "lost" or example.line in elided:
            continue
        if example.data != expected[example.line]["printed"]:
            wrong.append((example.line, example.data, expected[example.line]["printed"]))
        compared["examples: byte lines, byte by byte"] += 1
    assert wrong == []


def test_pages(reading: Reading, examples: Mapping[str, Any], compared: Counter[str]) -> None:
    """All examples, including those without bytes, are on the pages that they name."""
    wrong = []
    for slug, entry in examples.items():
        low, high = reading.document.pages(entry["line"])
        if not low <= entry["page"] <= high:
            wrong.append((slug, entry["page"], (low, high)))
    assert wrong == []
    compared["examples and statements, page"] = len(examples)

"""The documents as the programs read them, and the files with which they are compared."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import plain_yaml

from . import extract, text

SPEC = text.ROOT / "spec"
EXAMPLES = text.ROOT / "spec" / "thorlabs_apt" / "examples.yaml"
UNREADABLE = Path(__file__).parent / "unreadable.yaml"
CHAPTERS = ("generic", "motor", "motor_2", "solenoid", "piezo")


def path_of(name: str) -> Path:
    """Return the text of a document; without it skip the test, or fail in a CI that should have it."""
    path = text.find(name)
    if path is None:
        reason = f"the text of the vendor's document is not available (see {text.VARIABLE})"
        if os.environ.get("CI") and os.environ.get(text.VARIABLE) != text.WITHOUT:
            pytest.fail(reason)
        pytest.skip(reason)
    return path


def document(protocol: str) -> text.Document:
    """Return the document of a protocol."""
    return text.Document.read(path_of(protocol))


def witness(protocol: str) -> dict[str, Any]:
    """Return the files of the witness of a protocol by their names."""
    return {
        path.stem: plain_yaml.load(path.read_text(encoding="utf-8"))
        for path in sorted((SPEC / protocol / "printed").glob("*.yaml"))
    }


@pytest.fixture(scope="session")
def reading() -> extract.Reading:
    return extract.read(document("thorlabs_apt"))


@pytest.fixture(scope="session")
def printed() -> dict[str, Any]:
    return witness("thorlabs_apt")


@pytest.fixture(scope="session")
def command_document() -> text.Document:
    """Return the document of commands without a header."""
    return document("asi_ms2000")


@pytest.fixture(scope="session")
def printed_commands() -> dict[str, Any]:
    return witness("asi_ms2000")


@pytest.fixture(scope="session")
def messages(printed: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for chapter in CHAPTERS:
        found.update(printed[chapter]["messages"])
    return found


@pytest.fixture(scope="session")
def examples() -> dict[str, Any]:
    content: dict[str, Any] = plain_yaml.load(EXAMPLES.read_text(encoding="utf-8"))
    found: dict[str, Any] = content["examples"]
    return found


@pytest.fixture(scope="session")
def listed() -> list[dict[str, Any]]:
    content: dict[str, list[dict[str, Any]]] = plain_yaml.load(
        UNREADABLE.read_text(encoding="utf-8")
    )
    return content["places"]


@pytest.fixture(scope="session")
def compared() -> Iterator[Counter[str]]:
    """Count what was compared; the table is shown by pytest -s."""
    counts: Counter[str] = Counter()
    yield counts
    print("\n\nread from the document and compared:")
    for kind in sorted(counts):
        print(f"  {counts[kind]:5d}  {kind}")

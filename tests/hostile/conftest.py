"""The spec that has a text in every place, and what is generated from it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from places import Files, Place, complete_spec, representatives, write

from stagewire_generator import check, reader, render, strict_yaml
from stagewire_generator.strict_yaml import Document


@pytest.fixture(scope="session")
def files() -> Files:
    return complete_spec()


@pytest.fixture(scope="session")
def rendered(files: Files, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is generated from the complete spec as it stands."""
    return render(check(write(files, tmp_path_factory.mktemp("complete") / "spec")))


@pytest.fixture(scope="session")
def places(files: Files) -> list[Place]:
    """One place for every location of the schemas."""
    return representatives(files)


@pytest.fixture(scope="module", autouse=True)
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Work in an empty folder; whatever code comes to life would leave a file in it."""
    folder = tmp_path_factory.mktemp("workplace")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield
    assert list(folder.iterdir()) == []


@pytest.fixture(scope="module")
def quick_reading() -> Iterator[None]:
    """Read and validate a file that was found good once, and is the same, not again.

    It is nine tenths of the time of a check, and only one file differs from try to try.
    """
    load, valid = strict_yaml.load, reader.fits_schema
    good: dict[tuple[str, bytes], Document] = {}

    def load_once(path: Path, name: str, diagnostics: Any, **options: Any) -> Document | None:
        key = (name, path.read_bytes())
        if key not in good:
            before = len(diagnostics.found)
            document = load(path, name, diagnostics, **options)
            if document is None or len(diagnostics.found) > before:
                return document
            good[key] = document
        return good[key]

    def valid_once(document: Document, kind: str, diagnostics: Any, **options: Any) -> bool:
        if id(document) not in seen:
            if not valid(document, kind, diagnostics, **options):
                return False
            seen[id(document)] = document
        return True

    seen: dict[int, Document] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strict_yaml, "load", load_once)
        patch.setattr(reader, "fits_schema", valid_once)
        yield

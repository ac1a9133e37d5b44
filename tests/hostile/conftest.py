"""The spec that has a text in every place, and what is generated from it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from pathlib import Path
from typing import Any

import pytest
from places import Files, Place, complete_spec, representatives, write

from stagewire_generator import check, pipeline, reader, render, strict_yaml
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


Key = Hashable


class Recent:
    """What was made of the same things before, as long as it was used lately."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.kept: OrderedDict[Key, Any] = OrderedDict()

    def get(self, key: Key, make: Callable[[], Any], good: Callable[[], bool]) -> Any:
        """Return what was made for a key, or make it, and keep it if it is good."""
        if key in self.kept:
            self.kept.move_to_end(key)
            return self.kept[key]
        made = make()
        if good():
            self.kept[key] = made
            if len(self.kept) > self.most:
                self.kept.popitem(last=False)
        return made


@pytest.fixture(scope="module")
def quick_checking(quick_reading: None) -> Iterator[None]:
    """Check and render a protocol in whose files nothing was wrong, and that are the same, not again.

    Of the protocols of the spec one alone differs from try to try; each is checked and rendered by itself.
    """
    alone, overlays = pipeline.check_protocol, pipeline.check_overlays
    checked, over = Recent(16), Recent(16)

    def same(files: Any) -> Key:  # documents that were good are read once: quick_reading
        return tuple((kind, *map(id, documents)) for kind, documents in sorted(files.items()))

    def check_once(files: Any, diagnostics: Any, say: Any) -> Any:
        before = len(diagnostics.found)
        return checked.get(
            same(files),
            lambda: alone(files, diagnostics, say),
            lambda: len(diagnostics.found) == before,
        )

    def overlays_once(folder: Path, files: Any, chosen: Any, diagnostics: Any, say: Any) -> Any:
        before = len(diagnostics.found)
        found = sorted(path for path in (folder / "overlays").rglob("*") if path.is_file())
        key = (folder, same(files), tuple(chosen), *((path, path.read_bytes()) for path in found))
        return over.get(
            key,
            lambda: overlays(folder, files, chosen, diagnostics, say),
            lambda: len(diagnostics.found) == before,
        )

    def render_once(target: Callable[..., dict[str, str]]) -> Callable[..., dict[str, str]]:
        made = Recent(16)

        def render(protocol: Any, templates: Any) -> dict[str, str]:
            # what is kept keeps the protocol, so that no other one has its id
            _, files = made.get(
                (id(protocol), id(templates)),
                lambda: (protocol, target(protocol, templates)),
                lambda: True,
            )
            return files

        return render

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "check_protocol", check_once)
        patch.setattr(pipeline, "check_overlays", overlays_once)
        for name, target in pipeline.TARGETS.items():
            patch.setitem(pipeline.TARGETS, name, render_once(target))
        yield


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

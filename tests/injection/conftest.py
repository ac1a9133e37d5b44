"""A spec with a text in every place, and the code generated from it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from text_places import Files, Place, complete_spec, representatives, write

from quick_specs import quick_specs
from stagewire_generator import TARGETS, check, render


@pytest.fixture(scope="session")
def files() -> Files:
    return complete_spec()


@pytest.fixture(scope="session")
def rendered(files: Files, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The files generated from the unchanged complete spec."""
    return render(check(write(files, tmp_path_factory.mktemp("complete") / "spec")), TARGETS)


@pytest.fixture(scope="session")
def places(files: Files) -> list[Place]:
    """One place for each location in the schemas."""
    return representatives(files)


@pytest.fixture(scope="module", autouse=True)
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Work in an empty folder, in which executed payloads would leave a file."""
    folder = tmp_path_factory.mktemp("workplace")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield
    assert list(folder.iterdir()) == []


@pytest.fixture(scope="module")
def quick_checking() -> Iterator[None]:
    """Read, check and render only the parts that changed."""
    with quick_specs():
        yield

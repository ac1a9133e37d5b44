"""What several tests of the generated C share, made once a session."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_library import CommandLibrary, make_library, make_turtle
from testees import Testees
from toolchain import need

# The tests of the testee in Python are run again, with the one in C beside it.
sys.path.append(str(Path(__file__).parents[1] / "conformance"))


@pytest.fixture(scope="session")
def testees(tmp_path_factory: pytest.TempPathFactory) -> Testees:
    """The testees in C and in Python."""
    need("gcc")
    return Testees(tmp_path_factory.mktemp("testees"))


@pytest.fixture(scope="module")
def asks_both(testees: Testees) -> Iterator[None]:
    """Whatever a test asks the testee in Python is asked the one in C, too, and has to be answered alike."""
    import asking

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(asking, "serve", testees.serve)
        yield


@pytest.fixture(scope="session", params=["ms2000", "turtle"])
def library(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> CommandLibrary:
    """A protocol of commands in C and in Python: that of the registry, and one of the tests."""
    folder = tmp_path_factory.mktemp(request.param)
    return {"ms2000": make_library, "turtle": make_turtle}[request.param](folder)

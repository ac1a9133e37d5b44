"""Fixtures of the tests of the generated C, made once per session."""

from __future__ import annotations

import fcntl
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command_library import CommandLibrary, make_library, make_turtle
from testees import Testees
from toolchain import need

from checkout import TESTS
from parts import first_of

# The tests of the Python testee also run with the C testee.
sys.path.append(str(TESTS / "conformance" / "testees"))

Once = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Once:
    """Fill a folder once and return it; all processes of a test run share it."""
    base = tmp_path_factory.getbasetemp()
    root = base if worker_id == "master" else base.parent

    def once(name: str, fill: Callable[[Path], object]) -> Path:
        folder = root / name
        with open(root / f"{name}.lock", "a+", encoding="ascii") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            lock.seek(0)
            if not lock.read():
                folder.mkdir(exist_ok=True)
                fill(folder)
                lock.write("filled")
        return folder

    return once


@pytest.fixture(scope="session")
def testees(once: Once) -> Testees:
    """The testees in C and in Python."""
    need("gcc")
    return Testees(once("testees", Testees.build))


@pytest.fixture(scope="module")
def asks_both(testees: Testees) -> Iterator[None]:
    """Also send every request of a test to the C testee, whose answer must be the same."""
    import testee_calls

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(testee_calls, "serve", testees.serve)
        yield


@pytest.fixture(scope="session", params=first_of(["ms2000", "turtle"]))
def library(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> CommandLibrary:
    """A protocol of commands in C and in Python: one from the registry, and one of the tests."""
    folder = tmp_path_factory.mktemp(request.param)
    return {"ms2000": make_library, "turtle": make_turtle}[request.param](folder)

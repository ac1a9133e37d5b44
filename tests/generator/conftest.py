"""Specs for the tests of the generator: two small good ones, and copies of them to be changed.

``good_spec`` has messages with a header, ``good_commands`` has commands and their replies.
"""

from __future__ import annotations

import importlib
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from stagewire_generator import check, render
from stagewire_generator.model import Protocol

HERE = Path(__file__).parent
PACKAGES = ("stagewire_tiny", "stagewire_turtle")


@pytest.fixture(scope="session")
def good_spec() -> Path:
    """The small good spec; not to be changed."""
    return HERE / "good_spec"


@pytest.fixture
def spec(tmp_path: Path, good_spec: Path) -> Path:
    """A copy of the small good spec."""
    return Path(shutil.copytree(good_spec, tmp_path / "spec"))


@pytest.fixture(scope="session")
def good_commands() -> Path:
    """The small good spec of commands; not to be changed."""
    return HERE / "good_commands"


@pytest.fixture
def commands_spec(tmp_path: Path, good_commands: Path) -> Path:
    """A copy of the small good spec of commands."""
    return Path(shutil.copytree(good_commands, tmp_path / "commands"))


@pytest.fixture(scope="session")
def commands(good_commands: Path) -> Protocol:
    return check(good_commands)[0]


@pytest.fixture(scope="session")
def command_files(commands: Protocol) -> dict[str, str]:
    """What is generated from the small good spec of commands."""
    return render([commands])


@pytest.fixture(scope="session")
def protocol(good_spec: Path) -> Protocol:
    return check(good_spec)[0]


@pytest.fixture(scope="session")
def files(protocol: Protocol) -> dict[str, str]:
    """What is generated from the small good spec."""
    return render([protocol])


@pytest.fixture
def imported() -> Iterator[Callable[[Path], Any]]:
    """Import the package below a folder, afresh."""
    before = list(sys.path)

    def forget() -> None:
        for name in [n for n in sys.modules if n.split(".")[0] in PACKAGES]:
            del sys.modules[name]

    def load_package(folder: Path) -> Any:
        forget()
        sys.path[:] = [str(folder / "python"), *before]
        importlib.invalidate_caches()
        [package] = (folder / "python").glob("*/__init__.py")
        return importlib.import_module(package.parent.name)

    yield load_package
    forget()
    sys.path[:] = before

"""Specs for the tests of the generator: a small good one, and copies of it to be changed."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from stagewire_generator import check, render
from stagewire_generator.model import Protocol

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def good_spec() -> Path:
    """The small good spec; not to be changed."""
    return HERE / "good_spec"


@pytest.fixture
def spec(tmp_path: Path, good_spec: Path) -> Path:
    """A copy of the small good spec."""
    return Path(shutil.copytree(good_spec, tmp_path / "spec"))


@pytest.fixture(scope="session")
def protocol(good_spec: Path) -> Protocol:
    return check(good_spec)[0]


@pytest.fixture(scope="session")
def files(protocol: Protocol) -> dict[str, str]:
    """What is generated from the small good spec."""
    return render([protocol])

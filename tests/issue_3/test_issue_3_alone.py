"""The package of Issue 3 alone, without the overlays that are on by default."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from checkout import ROOT
from overlay_packages import call, command, generate
from stagewire_apt import PROTOCOL

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder to import the package of Issue 3 from."""
    return generate(tmp_path_factory.mktemp("issue_3"))


def test_all_worked_examples_of_issue_3_pass(package: Path) -> None:
    said = command(package, "conformance", "examples", "--summary", "--protocol", PROTOCOL.name)
    assert " 0 failed" in said


def test_no_overlay_is_applied(package: Path) -> None:
    assert "alias KDC101" in command(package, "show", "KDC101")
    assert "Issue 37" not in command(package, "show", "MOT_SET_VELPARAMS")
    assert "Issue 37" in command(ROOT / "generated" / "python", "show", "MOT_SET_VELPARAMS")


def test_controllers_newer_than_issue_3_use_the_messages_of_similar_units(package: Path) -> None:
    tests = str(HERE / "newer_controllers.py")
    arguments = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", tests]
    said = call(package, arguments, 0, ROOT / "tests" / "runtime" / "devices")
    assert " passed" in said
    assert "failed" not in said

"""The Make rule of the page."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from build_systems_page import blocks

from checkout import SMALL_SPECS

if TYPE_CHECKING:
    from conftest import Run


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder for Make, which does not support spaces in names."""
    shutil.copytree(SMALL_SPECS / "good_spec", tmp_path / "spec")
    return tmp_path


@pytest.mark.matrix
def test_make_generates_when_a_file_is_changed_or_added(project: Path, run: Run) -> None:
    [rule] = blocks("make")
    (project / "Makefile").write_text(rule, encoding="utf-8")
    (project / "build").mkdir()
    done = run("make")
    assert done.returncode == 0, done.stdout
    made = project / "build" / "protocols"
    assert (made / "manifest.json").is_file()
    assert "is up to date" in run("make").stdout
    path = project / "spec" / "tiny" / "messages" / "core.yaml"
    right = path.read_text(encoding="utf-8")
    path.write_text(f"{right}twice: 1\ntwice: 2\n", encoding="utf-8")
    wrong = run("make")
    assert wrong.returncode != 0
    assert "tiny/messages/core.yaml:" in wrong.stdout
    path.write_text(right.replace("the first", "Mended", 1), encoding="utf-8")
    assert run("make").returncode == 0
    assert "Mended" in (made / "python/stagewire_tiny/registry.json").read_text(encoding="utf-8")
    assert "is up to date" in run("make").stdout
    (project / "spec" / "tiny" / "messages" / "more.yaml").write_text("chapter: more\n")
    added = run("make")
    assert added.returncode != 0
    assert "spec/tiny/messages/more.yaml:1:1: SW" in added.stdout

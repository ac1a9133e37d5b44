"""tools/release_notes.py prints the notes of a version, or fails the release."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from checkout import ROOT

PROGRAM = ROOT / "tools" / "release_notes.py"
CHANGELOG = """# Changelog

Words for every release.

## 0.2.0 (2026-03-01)

SOURCE: a name.

### Library

- Something.

## 0.1.0 (2026-01-31)

The first.
"""


def run(folder: Path, changelog: str, version: str) -> int:
    """Run the program in a project with this changelog and version 0.2.0."""
    (folder / "pyproject.toml").write_text('[project]\nversion = "0.2.0"\n', encoding="utf-8")
    (folder / "CHANGELOG.md").write_text(changelog, encoding="utf-8")
    status: int = runpy.run_path(str(PROGRAM))["main"]([version], folder)
    return status


@pytest.mark.parametrize(
    "changelog", [CHANGELOG, CHANGELOG.partition("\n## 0.1.0")[0]], ids=["newest", "only one"]
)
def test_the_section_of_the_version_is_printed(
    tmp_path: Path, changelog: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path, changelog, "0.2.0") == 0
    assert capsys.readouterr().out == "SOURCE: a name.\n\n### Library\n\n- Something.\n"


@pytest.mark.parametrize(
    ("changelog", "version", "error"),
    [
        (CHANGELOG, "0.1.0", "pyproject.toml has version 0.2.0, not 0.1.0"),
        (CHANGELOG.replace("## 0.2.0", "## 0x2.0"), "0.2.0", "has no section '## 0.2.0 (YYYY"),
        (CHANGELOG.replace("2026-03-01", "not released yet"), "0.2.0", "needs a date"),
        (CHANGELOG.replace(" (2026-03-01)", ""), "0.2.0", "needs a date"),
        ("## 0.2.0 (2026-03-01)\n\n## 0.1.0 (2026-01-31)\n\nThe first.\n", "0.2.0", "is empty"),
        ("## 0.2.0 (2026-03-01)\n", "0.2.0", "is empty"),
    ],
)
def test_a_release_without_notes_fails(
    tmp_path: Path, changelog: str, version: str, error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path, changelog, version) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert error in err

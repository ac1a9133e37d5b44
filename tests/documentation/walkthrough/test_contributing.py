"""``docs/contributing.md`` does as it says, each of its walks in a checkout of its own."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from walk import Walk

from checkout import ROOT
from markdown_blocks import blocks

PAGE = ROOT / "docs" / "contributing.md"
BLOCKS = tuple(blocks(PAGE))
ROOMS = ("runtime", "generator", "virtual", "conformance", "cli")
WALKS = {
    "A message in ten minutes": (),
    "A correction of what was transcribed": (),
    "A framing, room by room": ROOMS,
}
"""Sections with a walk, and the rooms whose code it changes."""

GIT = {
    "GIT_AUTHOR_NAME": "Reader",
    "GIT_AUTHOR_EMAIL": "reader@example.org",
    "GIT_COMMITTER_NAME": "Reader",
    "GIT_COMMITTER_EMAIL": "reader@example.org",
    "GIT_CONFIG_GLOBAL": "/dev/null",
    "GIT_CONFIG_NOSYSTEM": "1",
}


@pytest.fixture
def walk(tmp_path: Path, section: str) -> Walk:
    """A reader in a checkout with all that a walk needs; its generated packages are those in use."""
    folder = tmp_path / "stagewire"
    for part in ("spec", "generated", *WALKS[section]):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / part, folder / part, ignore=ignored)
    shutil.copy(ROOT / ".gitignore", folder)
    reader = Walk(folder, {**GIT, "PYTHONPATH": str(folder / "generated" / "python")})
    for words in (["init"], ["add", "."], ["commit", "--quiet", "--message", "All"]):
        command = ["git", *words]
        subprocess.run(
            command, cwd=folder, env=reader.environment, check=True, capture_output=True, timeout=60
        )
    return reader


@pytest.mark.matrix
@pytest.mark.parametrize("section", WALKS)
def test_a_section_does_as_it_says(section: str, walk: Walk) -> None:
    followed = [block for block in BLOCKS if block.section == section]
    assert any(block.language == "console" for block in followed)
    for block in followed:
        walk.follow(block)


def test_there_is_no_other_block_that_nothing_runs() -> None:
    other = [block for block in BLOCKS if block.section not in WALKS]
    assert [(block.section, block.language) for block in other] == [("Set-up", "sh")]


def test_every_file_of_the_tables_is_there() -> None:
    generator = ROOT / "generator" / "stagewire_generator"
    rooms = (
        ROOT,
        ROOT / "docs",
        ROOT / "spec",
        generator,
        ROOT / "cli" / "stagewire_cli",
        ROOT / "spec" / "thorlabs_apt",
    )
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    names = {name for row in rows for name in re.findall(r"`([^`]*[/.][^`]*)`", row)}
    assert len(names) > 20
    elsewhere = [ROOT / name for name in names if (ROOT / name).is_dir()]  # named first in a row
    for name in names:
        pattern = re.sub(r"<\w+>", "*", name.rstrip("/"))
        assert any(next(room.glob(pattern), None) for room in (*rooms, *elsewhere)), name


def test_every_table_of_a_framing_is_there() -> None:
    row = re.compile(r"^\| `([^`]+)` \| .* \| `([A-Z_]+)` in `([^`]+)` \|$", re.M)
    found = row.findall(PAGE.read_text(encoding="utf-8"))
    assert [Path(room).name for room, *_ in found] == [
        "stagewire_generator",
        "stagewire_virtual",
        "stagewire_conformance",
        "stagewire_cli",
    ]
    for room, name, file in found:
        text = (ROOT / room / file).read_text(encoding="utf-8")
        assert re.search(rf"^{name}\b.*= ", text, re.M), f"{name} in {file}"

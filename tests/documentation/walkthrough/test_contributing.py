"""The commands on pages that walk through a change print what the page shows."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from walk import Walk

from checkout import ROOT
from markdown_blocks import blocks

DOCS = ROOT / "docs"
PAGE = DOCS / "contributing.md"
FRAMING = "how-to/add-a-framing.md"
WALKS = {
    "tutorials/new-message.md": (),
    "how-to/correct-a-fact.md": (),
    "how-to/overlays.md#Add a unit and its stage": (),
    FRAMING: ("runtime", "generator", "virtual", "conformance", "cli"),
}
"""Pages with a walkthrough, or its section, and the folders whose code it changes."""

GIT = {
    "GIT_AUTHOR_NAME": "Reader",
    "GIT_AUTHOR_EMAIL": "reader@example.org",
    "GIT_COMMITTER_NAME": "Reader",
    "GIT_COMMITTER_EMAIL": "reader@example.org",
    "GIT_CONFIG_GLOBAL": "/dev/null",
    "GIT_CONFIG_NOSYSTEM": "1",
}


@pytest.fixture
def walk(tmp_path: Path, page: str) -> Walk:
    """A walkthrough in a checkout of the files it needs, with their generated packages."""
    folder = tmp_path / "stagewire"
    for part in ("spec", "generated", *WALKS[page]):
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
@pytest.mark.parametrize("page", WALKS)
def test_the_commands_of_a_page_print_what_it_shows(page: str, walk: Walk) -> None:
    document, _, section = page.partition("#")
    followed = [block for block in blocks(DOCS / document) if section in ("", block.section)]
    assert any(block.language == "console" for block in followed)
    for block in followed:
        walk.follow(block)


def test_the_only_block_of_contributing_is_the_set_up() -> None:
    assert [(block.section, block.language) for block in blocks(PAGE)] == [("Set-up", "sh")]


def test_every_file_in_the_tables_exists() -> None:
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
    spans = {span for row in rows for span in re.findall(r"`([^`]*)`", row)}
    names = {span for span in spans if "/" in span or "." in span}
    assert len(names) > 20
    elsewhere = [ROOT / name for name in names if (ROOT / name).is_dir()]
    for name in names:
        pattern = re.sub(r"<\w+>", "*", name.rstrip("/"))
        assert any(next(room.glob(pattern), None) for room in (*rooms, *elsewhere)), name


def test_every_listed_table_of_framings_exists() -> None:
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

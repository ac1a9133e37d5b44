"""Every shell line of the documentation exits with the expected status, in a copy of the checkout."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from block_runners import BY_MACHINE, LONG, NOT_RUN, here
from shell import Shell, lines
from test_pages_data import blocks_of

from checkout import ROOT

PARTS = (
    "spec",
    "generated",
    "examples/python",
    "examples/javascript",
)
EXPECTED = ("docs/reference/codec-conformance.md", "schema_version = 1")
STATUS = b"\x91\x04\x0e\x00\x81\x50" + bytes(14)
GIT = [
    "git", "-c", "user.name=Reader", "-c", "user.email=reader@example.org",
    "-c", "commit.gpgsign=false", "-c", "tag.gpgsign=false",
]  # fmt: skip


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the files that the commands need, with two commits and a release tag on the first."""
    folder = tmp_path_factory.mktemp("reader") / "stagewire"
    for part in PARTS:
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "capture.bin").write_bytes(STATUS)
    (folder / "expected.toml").write_text(*blocks_of(*EXPECTED), encoding="utf-8")
    for words in (
        ["init", "--quiet"],
        ["add", "."],
        ["commit", "--quiet", "--message", "All"],
        ["tag", "v0.1.0"],
        ["commit", "--quiet", "--allow-empty", "--message", "Nothing more"],
    ):
        git(folder, *words)
    return folder


@pytest.fixture
def checkout(copied: Path) -> Iterator[Path]:
    """The copy. Files that a block wrote are removed afterwards."""
    yield copied
    git(copied, "clean", "-ffdq")


def git(folder: Path, *words: str) -> None:
    subprocess.run([*GIT, *words], cwd=folder, check=True, capture_output=True, timeout=60)


def typed() -> Iterator[Any]:
    """Yield the lines of every block, for a quick run without slow lines and for a full run in a shell."""
    for document, block in here("sh"):
        run = [line for line in lines(block.text) if line[0] not in NOT_RUN]
        quick = [line for line in run if line[0] not in LONG]
        name = f"{document}:{block.line}"
        if quick:
            yield pytest.param(quick, True, id=name)
        if run:
            yield pytest.param(run, False, id=f"{name}-in-a-shell", marks=pytest.mark.matrix)


@pytest.mark.skipif(sys.platform == "win32", reason="requires a POSIX shell")
@pytest.mark.parametrize(("block", "quick"), list(typed()))
def test_the_lines_of_a_block_exit_with_the_expected_status(
    block: list[tuple[str, int]], quick: bool, checkout: Path, tmp_path: Path
) -> None:
    with Shell(checkout, tmp_path, quick=quick) as shell:
        for command, status in block:
            shell.type(command, status, *([1] if command in BY_MACHINE else []))

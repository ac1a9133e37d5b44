"""Every line of shell in a document does what it says, in a copy of the checkout."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ledger import BY_MACHINE, NOT_RUN, here
from shell import Shell, lines
from test_pages_data import block_of

from fenced import ROOT, Block

PARTS = (
    "spec",
    "conformance/examples",
    "conformance/captures",
    "generated",
    "examples/python",
    "examples/javascript",
)
EXPECTED = ("docs/codec-conformance.md", "schema_version = 1")
STATUS = b"\x91\x04\x0e\x00\x81\x50" + bytes(14)
GIT = [
    "git", "-c", "user.name=Reader", "-c", "user.email=reader@example.org",
    "-c", "commit.gpgsign=false", "-c", "tag.gpgsign=false",
]  # fmt: skip


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what the commands work on: two commits, the first one released."""
    folder = tmp_path_factory.mktemp("reader") / "stagewire"
    for part in PARTS:
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "capture.bin").write_bytes(STATUS)
    (folder / "expected.toml").write_text(block_of(*EXPECTED), encoding="utf-8")
    for words in (
        ["init", "--quiet"],
        ["add", "."],
        ["commit", "--quiet", "--message", "All"],
        ["tag", "v0.1.0"],
        ["commit", "--quiet", "--allow-empty", "--message", "Nothing more"],
    ):
        subprocess.run([*GIT, *words], cwd=folder, check=True, capture_output=True, timeout=60)
    return folder


def typed() -> Iterator[Any]:
    """Give every block of which something can be run."""
    for document, block in here("sh"):
        if any(command not in NOT_RUN for command, _ in lines(block.text)):
            yield pytest.param(block, id=f"{document}:{block.line}")


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell is needed")
@pytest.mark.parametrize("block", list(typed()))
def test_the_lines_of_a_block(block: Block, checkout: Path, tmp_path: Path) -> None:
    with Shell(checkout, tmp_path) as shell:
        for command, status in lines(block.text):
            if command not in NOT_RUN:
                shell.type(command, status, *([1] if command in BY_MACHINE else []))

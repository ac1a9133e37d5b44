"""The command reads and writes text files as UTF-8, whatever the default encoding of the system."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT

CODE = "from stagewire_cli.main import run; run()"


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "spec"],
        ["generate", "--spec", "spec", "--out", "{folder}"],
        ["diff", "spec", "spec"],
        ["show", "MOT_MOVE_ABSOLUTE"],
        ["conformance", "examples"],
        ["decode", "{folder}/capture.hex", "--format", "csv", "--output", "{folder}/events.csv"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_no_command_uses_the_default_encoding(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "capture.hex").write_text("23 02 00 00 50 01\n", encoding="utf-8")
    options = ["-X", "warn_default_encoding", "-W", "error::EncodingWarning", "-c", CODE]
    filled = [argument.format(folder=tmp_path) for argument in arguments]
    done = subprocess.run(
        [sys.executable, *options, *filled],
        cwd=ROOT,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert "EncodingWarning" not in done.stderr
    assert done.returncode == 0, done.stderr

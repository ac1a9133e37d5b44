"""The commands of ``make demo`` succeed, and their output is short."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT

LINES = 60
ENVIRONMENT = ".venv/demo/bin/"


def recipe(*options: str) -> str:
    """Return the commands that ``make demo`` would run."""
    command = ("make", "--dry-run", "--no-print-directory", *options, "demo")
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


@pytest.mark.matrix
def test_demo_prints_at_most_sixty_lines() -> None:
    commands = recipe("--old-file=.venv/demo/ready")
    assert f"{ENVIRONMENT}stagewire conformance examples" in commands
    here = commands.replace(ENVIRONMENT, f"{Path(sys.executable).parent}/")
    ran = subprocess.run(
        ("sh", "-e", "-c", here), cwd=ROOT, capture_output=True, text=True, check=False
    )
    printed = (ran.stdout + ran.stderr).splitlines()
    assert ran.returncode == 0, ran.stdout + ran.stderr
    set_up = 1
    assert len(printed) + set_up <= LINES
    assert all(
        any(line.startswith(f"{name}: ") and " 0 failed" in line for line in printed)
        for name in ("asi_ms2000", "thorlabs_apt")
    )


def test_the_set_up_of_the_demo_prints_one_line() -> None:
    demo = recipe("--old-file=.venv/demo/ready").splitlines()
    lines = recipe("--what-if=pyproject.toml").splitlines()
    set_up = [line for line in lines if line not in demo]
    assert [line for line in set_up if line.startswith("echo ")] == set_up[:1]
    (pip,) = (line for line in set_up if " pip " in line)
    assert " -qq " in pip  # errors only

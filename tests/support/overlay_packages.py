"""Packages that are generated with an overlay, and programs that use them in place of the installed one."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from checkout import ROOT
from stagewire_cli.main import main


def generate(out: Path, overlay: str = "") -> Path:
    """Generate ``stagewire_apt`` with one overlay, or alone; return the folder to import it from."""
    spec = ROOT / "spec" / "thorlabs_apt"
    arguments = ["generate", "--base", "--spec", str(spec), "--out", str(out)]
    assert main([*arguments, *(["--overlay", overlay] if overlay else [])]) == 0
    return out / "python"


def environment_of(package: Path, *paths: Path) -> dict[str, str]:
    """Return the environment of programs that import the package, and modules in other folders."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (package, *paths)))}


def run(package: Path, program: str, *paths: Path) -> str:
    """Run a Python program with the package; return its output."""
    return call(package, [sys.executable, "-c", program], 0, *paths)


def command(package: Path, *arguments: str, status: int = 0) -> str:
    """Run the command ``stagewire`` with the package; return its output and its errors."""
    code = "from stagewire_cli.main import run; run()"
    return call(package, [sys.executable, "-c", code, *arguments], status)


def call(package: Path, arguments: Sequence[str], status: int, *paths: Path) -> str:
    """Run a program, which must end with this status; return its output and its errors."""
    done = subprocess.run(
        arguments,
        env=environment_of(package, *paths),
        capture_output=True,
        text=True,
        check=False,
    )
    output = done.stdout + done.stderr
    assert done.returncode == status, output
    return output

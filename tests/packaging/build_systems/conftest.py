"""A user's project with a small spec, and the programs that it uses."""

from __future__ import annotations

import os
import shutil
import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest

from checkout import SMALL_SPECS

SCRIPTS = sysconfig.get_path("scripts")  # where stagewire, cmake, ninja and pre-commit are

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with spaces in its name that contains the small good spec."""
    folder = tmp_path / "my own project"
    shutil.copytree(SMALL_SPECS / "good_spec", folder / "spec")
    return folder


@pytest.fixture
def run(project: Path) -> Run:
    """Run a program of this environment in the project."""

    def run(*words: object, **more: str) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join([SCRIPTS, os.environ.get("PATH", os.defpath)])
        done = subprocess.run(
            [shutil.which(str(words[0]), path=path) or str(words[0]), *map(str, words[1:])],
            cwd=project,
            env={**os.environ, "PATH": path, "LC_ALL": "C.UTF-8", **more},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            timeout=300,
        )
        assert "Traceback" not in done.stdout, done.stdout
        return done

    return run

"""npm programs for tests, installed once below ``.venv`` from a lock file."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from checkout import ROOT


def node_modules(room: Path) -> Path:
    """Return the folder with the packages of ``package-lock.json`` in a folder of the tests.

    The name of its parent depends on the lock file. Several test processes may install at the same time: each
    uses a temporary folder, and the first one renames it. Fails the test if npm is missing.
    """
    lock = room / "package-lock.json"
    folder = ROOT / ".venv" / room.name / hashlib.sha256(lock.read_bytes()).hexdigest()[:16]
    if folder.is_dir():
        return folder / "node_modules"
    npm = shutil.which("npm")
    if npm is None:
        pytest.fail(f"the tests in {room.name} require Node.js 18 or later, with npm")
    part = folder.with_name(f"{folder.name}.{os.getpid()}.part")
    part.mkdir(parents=True)
    for name in ("package.json", lock.name):
        shutil.copy(room / name, part)
    subprocess.run([npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=part, check=True)
    try:
        part.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise
        shutil.rmtree(part)
    return folder / "node_modules"

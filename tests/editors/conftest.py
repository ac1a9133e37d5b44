"""The YAML language server, installed once into ``.venv/editors`` and running for the tests of a process."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from language_server import LanguageServer

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
LOCK = HERE / "package-lock.json"


@pytest.fixture(scope="session")
def node_modules() -> Path:
    """The folder with the server; its parent is named after the lock file that it was installed by.

    Test processes may meet here: each installs into a folder of its own, and one of these gets the name.
    """
    folder = ROOT / ".venv" / "editors" / hashlib.sha256(LOCK.read_bytes()).hexdigest()[:16]
    if folder.is_dir():
        return folder / "node_modules"
    npm = shutil.which("npm")
    if npm is None:
        pytest.fail("the tests of editors need Node.js, 18 or later, with npm")
    part = folder.with_name(f"{folder.name}.{os.getpid()}.part")
    part.mkdir(parents=True)
    for name in ("package.json", LOCK.name):
        shutil.copy(HERE / name, part)
    subprocess.run([npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=part, check=True)
    try:
        part.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise
        shutil.rmtree(part)
    return folder / "node_modules"


@pytest.fixture(scope="session")
def server(node_modules: Path) -> Iterator[LanguageServer]:
    """A language server without the network, set up as ``docs/editors.md`` says."""
    with LanguageServer(
        node_modules / "yaml-language-server" / "bin" / "yaml-language-server"
    ) as it:
        yield it
        assert it.messages == []

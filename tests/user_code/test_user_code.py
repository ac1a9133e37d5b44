"""What mypy strict and pyright strict say of programs that users write, with mistakes and without.

A line with a mistake ends with ``# wrong: CODE RULE``: what mypy calls it, and what pyright does. Each of these
must be found, and nothing else may be. What comes back of a call is asserted in the programs themselves.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import npm

HERE = Path(__file__).parent
PROGRAMS = HERE / "programs"
CACHE = HERE.parents[1] / ".mypy_cache" / "user_code"
NAMES = sorted(path.name for path in PROGRAMS.glob("*.py"))

Found = dict[str, set[tuple[int, str]]]
"""By file: the lines with what is wrong there."""

_WRONG = re.compile(r"# wrong: (\S+) (\S+)$")


def expected(name: str, checker: int) -> set[tuple[int, str]]:
    """Return what the comments of a program say that a checker finds: 0 mypy, 1 pyright."""
    lines = (PROGRAMS / name).read_text(encoding="utf-8").splitlines()
    return {
        (number, wrong.groups()[checker])
        for number, line in enumerate(lines, 1)
        if (wrong := _WRONG.search(line))
    }


@pytest.fixture(scope="module")
def mypy() -> Found:
    """What mypy finds, with the settings that are called strict and no others."""
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", os.devnull]
    options = ["--cache-dir", str(CACHE), "--output", "json", "--no-error-summary"]
    done = subprocess.run(
        [*command, *options, *NAMES], cwd=PROGRAMS, capture_output=True, text=True, timeout=600
    )
    assert done.stderr == ""
    found: Found = {}
    for line in done.stdout.splitlines():
        said = json.loads(line)
        if said["severity"] == "error":
            found.setdefault(said["file"], set()).add((said["line"], said["code"]))
    return found


@pytest.fixture(scope="module")
def pyright(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """What pyright finds, with the settings that are called strict and no others."""
    project = tmp_path_factory.mktemp("pyright") / "pyrightconfig.json"
    project.write_text(json.dumps({"include": [str(PROGRAMS)], "typeCheckingMode": "strict"}))
    program = npm.node_modules(HERE) / "pyright" / "index.js"
    command = ["node", str(program), "--outputjson", "--pythonpath", sys.executable]
    done = subprocess.run(
        [*command, "--project", str(project)], capture_output=True, text=True, timeout=600
    )
    assert done.stderr == ""
    found: Found = {}
    for said in json.loads(done.stdout)["generalDiagnostics"]:
        line = said["range"]["start"]["line"] + 1
        found.setdefault(Path(said["file"]).name, set()).add((line, said["rule"]))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_mypy_finds_the_mistakes_and_nothing_else(name: str, mypy: Found) -> None:
    assert mypy.get(name, set()) == expected(name, 0)


@pytest.mark.parametrize("name", NAMES)
def test_pyright_finds_the_mistakes_and_nothing_else(name: str, pyright: Found) -> None:
    assert pyright.get(name, set()) == expected(name, 1)


def test_there_are_both_kinds_of_both() -> None:
    assert NAMES == ["bad_asyncio.py", "bad_sync.py", "good_asyncio.py", "good_sync.py"]
    for name in NAMES:
        assert bool(expected(name, 0)) == name.startswith("bad"), name

"""The findings of mypy strict and pyright strict in programs of users, with and without mistakes.

A line with a mistake ends with ``# wrong: CODE RULE``: the code of mypy and the rule of pyright. Each mistake
must be found, and nothing else, except that pyright reports unknown types that follow from a mistake. The
programs themselves assert the types of results. The complete programs in the pages for users have no mistake.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import npm

HERE = Path(__file__).parent
PROGRAMS = HERE / "programs"
NAMES = sorted(path.name for path in PROGRAMS.glob("*.py"))
PAGES = ("how-to/devices.md", "tutorials/first-stage.md")
IN_PAGES = {
    f"{Path(page).stem.replace('-', '_')}_{number}.py": program
    for page in PAGES
    for number, program in enumerate(
        re.findall(
            r"^```python\n(.*?)^```",
            (npm.ROOT / "docs" / page).read_text(encoding="utf-8"),
            re.DOTALL | re.MULTILINE,
        )
    )
    if ".open(" in program and "import" in program
}
"""The complete programs in pages."""

Found = dict[str, set[tuple[int, str]]]
"""By file: the lines with what is wrong there."""

_WRONG = re.compile(r"# wrong: (\S+) (\S+)$")


def expected(name: str, checker: int) -> set[tuple[int, str]]:
    """Return the findings that the comments of a program expect: 0 of mypy, 1 of pyright."""
    lines = (PROGRAMS / name).read_text(encoding="utf-8").splitlines()
    return {
        (number, wrong.groups()[checker])
        for number, line in enumerate(lines, 1)
        if (wrong := _WRONG.search(line))
    }


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs in a separate folder, configured only with the strict mode of the checkers."""
    folder = tmp_path_factory.mktemp("project")
    shutil.copytree(PROGRAMS, folder, dirs_exist_ok=True)
    for name, program in IN_PAGES.items():
        (folder / name).write_text(program, encoding="utf-8")
    (folder / "mypy.ini").write_text("[mypy]\nstrict = True\n")
    (folder / "pyrightconfig.json").write_text('{"typeCheckingMode": "strict"}')
    return folder


def run(project: Path, *command: str) -> str:
    """Run a checker in the project and return its output."""
    done = subprocess.run(command, cwd=project, capture_output=True, text=True, timeout=600)
    assert done.stderr == ""
    return done.stdout


@pytest.fixture(scope="module")
def mypy(project: Path) -> Found:
    """The findings of mypy."""
    options = ["--output", "json", "--no-error-summary"]
    found: Found = {}
    for line in run(
        project, sys.executable, "-m", "mypy", *options, *NAMES, *IN_PAGES
    ).splitlines():
        said = json.loads(line)
        if said["severity"] == "error":
            found.setdefault(said["file"], set()).add((said["line"], said["code"]))
    return found


@pytest.fixture(scope="module")
def pyright(project: Path) -> Found:
    """The findings of pyright."""
    program = npm.node_modules(HERE) / "pyright" / "index.js"
    output = run(project, "node", str(program), "--outputjson", "--pythonpath", sys.executable)
    found: Found = {}
    for said in json.loads(output)["generalDiagnostics"]:
        line = said["range"]["start"]["line"] + 1
        found.setdefault(Path(said["file"]).name, set()).add((line, said["rule"]))
    return found


@pytest.mark.matrix
@pytest.mark.parametrize("name", NAMES)
def test_mypy_finds_the_mistakes_and_nothing_else(name: str, mypy: Found) -> None:
    assert mypy.get(name, set()) == expected(name, 0)


@pytest.mark.matrix
@pytest.mark.parametrize("name", NAMES)
def test_pyright_finds_the_mistakes_and_nothing_else(name: str, pyright: Found) -> None:
    found = pyright.get(name, set())
    if name.startswith("bad"):
        found = {(line, rule) for line, rule in found if not rule.startswith("reportUnknown")}
    assert found == expected(name, 1)


def test_programs_exist_with_and_without_mistakes_for_both_apis() -> None:
    assert NAMES == ["bad_asyncio.py", "bad_sync.py", "good_asyncio.py", "good_sync.py"]
    for name in NAMES:
        assert bool(expected(name, 0)) == name.startswith("bad"), name


@pytest.mark.matrix
def test_mypy_accepts_the_programs_in_the_pages(mypy: Found) -> None:
    assert {name: mypy[name] for name in IN_PAGES if name in mypy} == {}


@pytest.mark.matrix
def test_pyright_accepts_the_programs_in_the_pages(pyright: Found) -> None:
    found = {
        (name, line, rule)
        for name in IN_PAGES
        for line, rule in pyright.get(name, ())
        if not rule.startswith(("reportUnknown", "reportMissingTypeStubs"))  # of pandas and pint
    }
    assert found == set()

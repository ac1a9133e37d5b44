"""`make interop`: the table of results, its exit status, and its independence of the product."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT

INTEROP = ROOT / "interop"

PROGRAM = """
import sys
sys.path.insert(0, {interop!r})
from results import Results
results = Results({package!r})
if results.installed:
    {body}
results.finish()
"""


def run(folder: Path, body: str, package: str = "pytest") -> tuple[int, str]:
    program = folder / "program.py"
    text = PROGRAM.format(interop=str(INTEROP), package=package, body=body)
    program.write_text(text, encoding="utf-8")
    command = [sys.executable, str(INTEROP / "run.py"), str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


@pytest.mark.parametrize(
    ("body", "status", "row"),
    [
        ("results.check('A', 'opens', True, 'yes')", 0, "passed .* A .* opens .* yes"),
        ("results.check('A', 'opens', False, 'no answer')", 1, "failed .* A .* opens .* no answer"),
        ("results.known('A', 'opens', False, 'too old')", 0, "known .* A .* opens .* too old"),
        ("results.known('A', 'opens', True, 'too old')", 1, "failed .* A .* works, although"),
        (
            "results.known('A', 'opens', False, 'late', always=False)",
            0,
            "known .* A .* opens .* late",
        ),
        (
            "results.known('A', 'opens', True, 'late', always=False)",
            0,
            "passed .* A .* this time.* late",
        ),
        ("raise SystemExit(3)", 1, "failed .* program .* finishes .* exit status 3"),
    ],
    ids=["passed", "failed", "known", "known but works", "at times", "not this time", "ended"],
)
def test_a_result_is_in_the_table_and_decides_the_exit_status(
    body: str, status: int, row: str, tmp_path: Path
) -> None:
    found, table = run(tmp_path, body)
    assert found == status, table
    assert re.search(row, table), table


def test_a_package_that_is_not_installed_is_reported_and_does_not_fail_the_run(
    tmp_path: Path,
) -> None:
    status, table = run(tmp_path, "raise AssertionError", package="not-installed-here")
    assert status == 0
    assert re.search("missing .*not-installed-here .* is installed", table)


def test_the_requirements_are_ranges_and_no_extra_of_the_product() -> None:
    lines = (INTEROP / "requirements.txt").read_text(encoding="utf-8").splitlines()
    names = []
    for line in lines:
        if line and not line.startswith("#"):
            found = re.fullmatch(r"([A-Za-z0-9_-]+)>=[\d.]+,<[\d.]+", line)
            assert found, line
            names.append(found[1])
    assert "thorlabs_xa" in names
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert "thorlabs_xa" not in project


def test_every_program_is_run() -> None:
    sys.path.insert(0, str(INTEROP))
    try:
        import run as runner
    finally:
        sys.path.remove(str(INTEROP))
    programs = {
        path.stem
        for path in INTEROP.glob("*.py")
        if "results.finish()" in path.read_text(encoding="utf-8") and path.stem != "results"
    }
    assert set(runner.PROGRAMS) == programs

"""Run the programs that compare Stagewire with third-party software, and print all results.

    make interop                                       # sets up .venv/interop and runs all programs
    .venv/interop/bin/python interop/run.py xa_drives_virtual

Exit status 1: an expectation failed, or a program did not finish. A package that is not installed is reported
and is not a failure.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from results import Result, Verdict, read, show

HERE = Path(__file__).parent
PROGRAMS = (
    "xa_drives_virtual",
    "devices_drive_xa",
    "suite_on_xa",
    "pnpq_drives_virtual",
    "apt_device_drives_virtual",
    "qmi_drives_virtual",
    "pylablib_drives_virtual",
    "pylablib_families",
)
"""The programs, in this folder; each is a module with the docstring that explains it."""
LONGEST = 900
"""The seconds after which a program is ended."""


def run(program: Path, folder: Path) -> list[Result]:
    """Run a program and return its results; one that does not finish is a failed result."""
    file = folder / f"{program.stem}.json"
    command = [sys.executable, str(program), "--results", str(file)]
    try:
        status = subprocess.run(command, timeout=LONGEST, check=False).returncode
        why = f"exit status {status}"
    except subprocess.TimeoutExpired:
        why = f"not finished after {LONGEST} s"
    if file.exists():
        return read(file)
    return [Result("", program.stem, "finishes", Verdict.FAILED, why)]


def main(names: Sequence[str]) -> int:
    """Run programs, by name in this folder or by path."""
    results: list[Result] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names or PROGRAMS:
            print(f"== {name}", flush=True)
            program = Path(name) if name.endswith(".py") else HERE / f"{name}.py"
            results += run(program, Path(folder))
    return show(results)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

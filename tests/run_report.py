"""Report on a test run: seconds by folder, skipped tests, and the budget of processor time.

    python tests/run_report.py build/junit-*.xml
    python tests/run_report.py --measure build/test.json COMMAND...
    python tests/run_report.py --measured build/test.json --budget 540 build/junit-*.xml

The first form prints the seconds of each folder from JUnit reports. It fails if no test ran, and in CI if a
test was skipped. ``STAGEWIRE_DOCUMENTS=none`` allows skips of the tests of the vendors' documents. The second
form runs a command, and writes the time of the command and its child processes to a file. The third form also
fails if that processor time exceeds the budget.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from junitparser import JUnitXml, Skipped

_DOCUMENTS = "tests.spec.document."


@dataclass
class Folder:
    """Number and duration of the tests of a folder."""

    tests: int = 0
    seconds: float = 0.0


def folders(cases: Sequence[object]) -> dict[str, Folder]:
    """Return the folders below ``tests/`` with the duration of their tests, slowest first."""
    found: dict[str, Folder] = {}
    for case in cases:
        parts = case.classname.split(".")[1:]  # the first is "tests"
        name = "/".join(takewhile(lambda part: not part.startswith("test_"), parts)) or "."
        folder = found.setdefault(name, Folder())
        folder.tests += 1
        folder.seconds += case.time or 0.0
    return dict(sorted(found.items(), key=lambda item: -item[1].seconds))


def main(arguments: Sequence[str] | None = None) -> int:
    """Report or measure, depending on the options; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--measure", metavar="FILE", help="run a command and write its times to FILE"
    )
    parser.add_argument("--measured", metavar="FILE", help="check the times that --measure wrote")
    parser.add_argument("--budget", type=float, help="limit of the processor time in seconds")
    parser.add_argument("rest", nargs=argparse.REMAINDER, metavar="REPORT... or COMMAND...")
    given = parser.parse_args(arguments)
    if given.measure:
        return _measure(Path(given.measure), given.rest)
    passed = _report(given.rest)
    if given.measured:
        passed &= _within_budget(Path(given.measured), given.budget)
    return 0 if passed else 1


def _measure(path: Path, command: Sequence[str]) -> int:
    path.unlink(missing_ok=True)
    began = time.monotonic()
    status = subprocess.run(command, check=False).returncode
    used = os.times()
    processor = used.children_user + used.children_system
    times = {"wall": time.monotonic() - began, "processor": processor}
    if status == 0:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(times), encoding="utf-8")
        print(_said(times))
    return status


def _said(times: dict[str, float]) -> str:
    return f"{times['wall']:.0f} s of wall time, {times['processor']:.0f} s of processor time"


def _report(paths: Sequence[str]) -> bool:
    cases = [case for path in paths for suite in JUnitXml.fromfile(path) for case in suite]
    skipped = [case for case in cases if any(isinstance(r, Skipped) for r in case.result)]
    print(f"{'folder':<26}{'tests':>8}{'seconds':>10}")
    for name, folder in folders(cases).items():
        print(f"{name:<26}{folder.tests:>8,}{folder.seconds:>10.1f}")
    print(f"{'all':<26}{len(cases):>8,}{sum(case.time or 0 for case in cases):>10.1f}")
    for case in skipped:
        print(f"skipped: {case.classname}::{case.name}: {case.result[0].message}")
    print(f"{len(cases)} tests in the report, {len(skipped)} skipped")
    if not cases:
        print("no test ran")
    if os.environ.get("STAGEWIRE_DOCUMENTS") == "none":
        skipped = [case for case in skipped if not (case.classname or "").startswith(_DOCUMENTS)]
    return bool(cases) and not (skipped and os.environ.get("CI"))


def _within_budget(path: Path, budget: float) -> bool:
    times = json.loads(path.read_text(encoding="utf-8"))
    within = bool(times["processor"] <= budget)
    verdict = "within" if within else "OVER"
    print(
        f"make test took {_said(times)}: {verdict} its budget of {budget:.0f} s of processor time"
    )
    if not within:
        print(
            "make tests cheaper, or move a matrix to make test-all; the table above shows the slowest folders"
        )
    return within


if __name__ == "__main__":
    sys.exit(main())

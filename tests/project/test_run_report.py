"""The report on a test run: skips fail in CI, seconds are summed by folder, and the budget is checked."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from run_report import main

PASSED = (
    '<testcase classname="tests.conformance.firmware.test_a.TestClass" name="test_one" time="1.5"/>'
)
SKIPPED = (
    '<testcase classname="tests.test_b" name="test_two"><skipped message="no document"/></testcase>'
)


def report(folder: Path, *cases: str) -> str:
    path = folder / "junit.xml"
    text = f"<testsuites><testsuite>{''.join(cases)}</testsuite></testsuites>"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("cases", "in_ci", "elsewhere"),
    [(PASSED, 0, 0), (PASSED + SKIPPED, 1, 0), (SKIPPED, 1, 0), ("", 1, 1)],
    ids=["all ran", "one skipped", "all skipped", "no test"],
)
def test_skips_fail_in_ci_and_an_empty_run_fails_everywhere(
    cases: str,
    in_ci: int,
    elsewhere: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = report(tmp_path, cases)
    monkeypatch.delenv("STAGEWIRE_DOCUMENTS", raising=False)
    monkeypatch.setenv("CI", "true")
    assert main([path]) == in_ci
    monkeypatch.delenv("CI")
    capsys.readouterr()
    assert main([path]) == elsewhere
    said = capsys.readouterr().out
    assert ("skipped: tests.test_b::test_two: no document\n" in said) == (SKIPPED in cases)
    assert (
        f"{cases.count('<testcase')} tests in the report, {cases.count('<skipped')} skipped" in said
    )


@pytest.mark.parametrize(
    ("name", "status"), [("tests.spec.document.test_a", 0), ("tests.spec.documents", 1)]
)
def test_ci_may_skip_the_tests_of_the_vendors_documents(
    name: str, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = report(tmp_path, SKIPPED.replace("tests.test_b", name))
    monkeypatch.setenv("CI", "true")
    monkeypatch.setenv("STAGEWIRE_DOCUMENTS", "none")
    assert main([path]) == status
    monkeypatch.delenv("STAGEWIRE_DOCUMENTS")
    assert main([path]) == 1


def test_seconds_are_summed_by_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = '<testcase classname="tests.test_c" name="test_three" time="0.25"/>'
    assert main([report(tmp_path, root, PASSED, PASSED)]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[1:4] == [
        ["conformance/firmware", "2", "3.0"],
        [".", "1", "0.2"],
        ["all", "3", "3.2"],
    ]


@pytest.mark.parametrize(("processor", "status"), [(539.0, 0), (541.0, 1)])
def test_the_budget_limits_processor_time(
    processor: float, status: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times = tmp_path / "test.json"
    times.write_text(json.dumps({"wall": 9_999.0, "processor": processor}), encoding="utf-8")
    path = report(tmp_path, PASSED)
    assert main(["--measured", str(times), "--budget", "540", path]) == status
    assert ("OVER" in capsys.readouterr().out) == bool(status)


def test_the_measured_time_includes_child_processes(tmp_path: Path) -> None:
    """The processor time of child processes counts, and the exit status of the command is returned."""
    times = tmp_path / "build" / "test.json"
    burn = "import time\nwhile time.process_time() < 0.3: pass"
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {burn!r}], check=True)"
    assert main(["--measure", str(times), sys.executable, "-c", child]) == 0
    assert json.loads(times.read_text(encoding="utf-8"))["processor"] >= 0.3
    assert main(["--measure", str(times), sys.executable, "-c", "raise SystemExit(7)"]) == 7
    assert not times.exists()

"""What reads the report of a run: skips are named, and in CI they fail it."""

from __future__ import annotations

from pathlib import Path

import pytest

from no_skips import main

PASSED = '<testcase classname="tests.a" name="test_one"/>'
SKIPPED = (
    '<testcase classname="tests.a" name="test_two"><skipped message="no document"/></testcase>'
)


@pytest.mark.parametrize(
    ("cases", "in_ci", "elsewhere"),
    [(PASSED, 0, 0), (PASSED + SKIPPED, 1, 0), (SKIPPED, 1, 0), ("", 1, 1)],
    ids=["all ran", "one skipped", "all skipped", "no test"],
)
def test_exit_status(
    cases: str,
    in_ci: int,
    elsewhere: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    report = tmp_path / "junit.xml"
    report.write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>", encoding="utf-8")
    monkeypatch.setenv("CI", "true")
    assert main(str(report)) == in_ci
    monkeypatch.delenv("CI")
    capsys.readouterr()
    assert main(str(report)) == elsewhere
    said = capsys.readouterr().out
    assert ("skipped: tests.a::test_two: no document\n" in said) == (SKIPPED in cases)
    assert (
        f"{cases.count('<testcase')} tests in the report, {cases.count('<skipped')} skipped" in said
    )

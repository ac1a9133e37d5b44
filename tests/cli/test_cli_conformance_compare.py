"""``stagewire conformance compare``: output, exit status, and files that are not reports."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from conftest import Stagewire

COMPARE = ("conformance", "compare")
GOOD = "virtual://TDC001?stage=Z8"
SILENT = f"{GOOD}&faults=to_host drop frame message=MOT_GET_HOMEPARAMS"
ID = "answers/0x50/MOT_REQ_HOMEPARAMS/1"


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the reports of two firmware versions, made by the command itself."""
    return tmp_path_factory.mktemp("reports")


@pytest.fixture
def files(stagewire: Stagewire, reports: Path) -> tuple[Path, Path]:
    found = []
    for name, url in (("good", GOOD), ("silent", SILENT)):
        path = reports / f"{name}.json"
        if not path.exists():
            words = ("conformance", "device", url, "--unit", "TDC001", "--only", "answers")
            stagewire(*words, "--json", path)
        found.append(path)
    good, silent = found
    return good, silent


def test_a_new_failure_is_shown_and_sets_the_exit_status(
    stagewire: Stagewire, files: tuple[Path, Path]
) -> None:
    result = stagewire(*COMPARE, *files)
    assert (result.code, result.err) == (1, "")
    assert f"  {ID}: PASS -> FAIL" in result.out.splitlines()
    assert "    new: MOT_REQ_HOMEPARAMS for channel 1 to 0x50 was not answered" in result.out
    assert result.out.splitlines()[-1].startswith("WORSE: PASSED IN PART (partial run) -> FAILED")


def test_an_improvement_has_exit_status_0(stagewire: Stagewire, files: tuple[Path, Path]) -> None:
    result = stagewire(*COMPARE, *reversed(files), "--json")
    assert (result.code, result.err) == (0, "")
    said = json.loads(result.out)
    assert not said["worse"]
    assert [(case["id"], case["change"]) for case in said["cases"]] == [(ID, "better")]


def test_other_files_are_refused(
    stagewire: Stagewire, files: tuple[Path, Path], tmp_path: Path
) -> None:
    good, _ = files
    other = tmp_path / "other.json"
    other.write_text('{"kind": "device"}')
    for new, said in (
        (tmp_path / "missing.json", "cannot read the file"),
        (tmp_path, "cannot read the file"),
        (other, "not a conformance report"),
    ):
        result = stagewire(*COMPARE, good, new)
        assert (result.code, result.out) == (2, "")
        assert f"{new}: {said}" in result.err
        assert "Traceback" not in result.err

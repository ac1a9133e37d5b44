"""Coordinates and limits are saved, and restored only on request."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from iocs import bench_of, running

from stagewire_epics.autosave import Autosave, AutosaveError

URL = "virtual://TDC001?stage=Z8"
CHANGED = {"OFF": 1.5, "DLLM": 1.0, "DHLM": 9.0, "TWV": 0.25}


def kept(path: Path, changes: dict[str, float], *, restored: bool = False) -> dict[str, Any]:
    """Run an IOC with autosave, change fields, and return the fields at the end."""

    async def body() -> dict[str, Any]:
        def saving(motors: Any) -> Autosave:
            autosave = Autosave(path, motors)
            if restored:
                autosave.restore()
            return autosave

        async with running(bench_of(URL), autosave=saving) as x:
            for field, value in changes.items():
                await x.put(field, value)
            return {field: x[field] for field in (*CHANGED, "RBV", "LLM", "HLM")}

    return asyncio.run(body())


def test_saved_coordinates_are_restored_on_request(tmp_path: Path) -> None:
    path = tmp_path / "lab.json"
    first = kept(path, CHANGED)
    assert first["RBV"] == 1.5
    saved = json.loads(path.read_text())
    assert {field: saved["x"][field] for field in CHANGED} == CHANGED
    assert kept(path, {}, restored=True) == first


def test_without_a_request_nothing_is_restored_and_the_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "lab.json"
    kept(path, CHANGED)
    before = path.read_text()
    assert kept(path, {"VAL": 0.1})["OFF"] == 0.0
    assert path.read_text() == before
    assert kept(path, {"TWV": 2.0})["OFF"] == 0.0
    assert path.with_name("lab.json.bak").read_text() == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "cannot restore"),
        ("[]", "expected an object with motors by name"),
        ('{"y": {"OFF": 1}}', "cannot restore y: expected motors of the bench"),
        ('{"x": {"VELO": 1}}', "cannot restore x"),
        ('{"x": {"OFF": "far"}}', "'far' is not a number"),
        ('{"x": {"DLLM": 3, "DHLM": 2}}', "DLLM 3 is above DHLM 2"),
    ],
)
def test_an_unusable_file_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "lab.json"
    path.write_text(text)
    with pytest.raises(AutosaveError, match=said):
        kept(path, {}, restored=True)


def test_a_directory_that_is_missing_is_reported_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(AutosaveError, match="is not a directory that can be written"):
        Autosave(tmp_path / "none" / "lab.json", {})


def test_a_file_that_cannot_be_written_is_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "lab.json"
    (tmp_path / "lab.json.new").mkdir()
    assert kept(path, {"TWV": 0.5})["TWV"] == 0.5
    assert f"{path}: cannot save: " in caplog.text

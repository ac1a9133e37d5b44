"""``stagewire conformance pics``: it drafts a valid file and moves nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from attached_controller import URL, attached

import stagewire_virtual as virtual
from stagewire_conformance.device.pics_file import read_pics

if TYPE_CHECKING:
    from conftest import Stagewire

PICS = ("conformance", "pics")


@pytest.mark.parametrize("unit", ["TDC001", "BBD102", "TPZ001", "MS2000"])
def test_the_suite_accepts_the_file(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, unit: str
) -> None:
    path = tmp_path / "pics.toml"
    with getattr(virtual, unit)() as controller:
        attached(monkeypatch, controller)
        result = stagewire(*PICS, "--from", URL, "--unit", unit, "--out", path)
    assert result.code == 0
    assert result.out.startswith(f"written: {path}; ")
    assert read_pics(path).unit == unit
    assert sorted(tmp_path.iterdir()) == [path]


def test_the_draft_is_printed_without_a_file(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with virtual.TDC001() as tdc:
        attached(monkeypatch, tdc)
        result = stagewire(*PICS, "--from", URL)
    assert result.code == 0
    (tmp_path / "pics.toml").write_text(result.out, encoding="utf-8")
    assert read_pics(tmp_path / "pics.toml").unit == "TDC001"


@pytest.mark.parametrize("unit", ["BBD102", "TDC001"])
def test_a_controller_that_reports_another_unit_gets_a_warning(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, unit: str
) -> None:
    path = tmp_path / "pics.toml"
    with virtual.TDC001() as tdc:
        attached(monkeypatch, tdc)
        result = stagewire(*PICS, "--from", URL, "--unit", unit, "--out", path)
    assert result.code == 0
    assert read_pics(path).unit == unit
    said = (
        f"--unit {unit} was given, but the controller reports that it is a TDC001 with the serial"
    )
    for text in (result.err, path.read_text(encoding="utf-8")):
        assert (said in text) is (unit != "TDC001")


def test_nothing_is_set_and_nothing_moves(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual.TDC001() as tdc:
        line = attached(monkeypatch, tdc)
        assert stagewire(*PICS, "--from", URL, "--unit", "TDC001").code == 0
    sent = line.sent()
    assert "HW_REQ_INFO" in sent
    assert {name for name in sent if "_REQ_" not in name} == set()


def test_an_existing_file_is_not_overwritten(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "pics.toml"
    path.write_text("by hand", encoding="utf-8")
    with virtual.TDC001() as tdc:
        line = attached(monkeypatch, tdc)
        result = stagewire(*PICS, "--from", URL, "--out", path)
    assert result.code == 2
    assert f"{path} already exists" in result.err
    assert path.read_text(encoding="utf-8") == "by hand"
    assert line.written == []


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--from", "virtual://TDC001", "--unit", "TDC999"], 2, "unknown unit TDC999"),
        (
            ["--from", "virtual://TDC001", "--out", "no/folder/x.toml"],
            2,
            "--out: missing folder",
        ),
        (["--from", "virtual://TDC001", "--out", "-"], 2, "--out: - is not a file"),
        (["--from", "/dev/there-is-none"], 4, "cannot be opened"),
        ([], 2, "--from"),
    ],
    ids=["unit", "folder", "dash", "port", "nothing"],
)
def test_a_draft_that_cannot_be_made_is_an_error(
    stagewire: Stagewire, words: list[str], code: int, said: str
) -> None:
    result = stagewire(*PICS, *words)
    assert result.code == code
    assert said in result.err
    assert result.out == ""


def test_a_line_without_answers_ends_the_run(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "pics.toml"
    with virtual.TDC001(faults=["to_host drop frame"]) as tdc:
        attached(monkeypatch, tdc)
        result = stagewire(*PICS, "--from", URL, "--unit", "TDC001", "--out", path)
    assert result.code == 4
    assert "no answer at" in result.err
    assert not path.exists()

"""``stagewire doctor``: its diagnoses, its advice and its exit codes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from serial_ports import linux, port, show
from stagewire._discovery import ports as system

if TYPE_CHECKING:
    from conftest import Stagewire


@pytest.fixture(autouse=True)
def a_computer_with_nothing_plugged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(system, "usb_devices", list)


def test_a_computer_without_controllers_is_diagnosed(stagewire: Stagewire) -> None:
    result = stagewire("doctor")
    assert result.code == 1
    first, advice, *_ = result.out.splitlines()
    assert first.startswith("WRONG  USB: no controller found")
    assert advice.startswith("       check that it is switched on")


def test_a_usable_port_is_fine(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    show(monkeypatch, linux(str(device), "83000001"), port("/dev/ttyS0"))
    result = stagewire("doctor")
    assert (result.code, result.err) == (0, "")
    fine, note, advice = result.out.splitlines()
    assert fine == f"fine   {device}: TDC001: One-channel T-Cube DC servo driver"
    assert note.startswith("note   /dev/ttyS0: unknown")
    assert "stagewire doctor /dev/ttyS0" in advice


def test_a_controller_that_answers_is_fine(stagewire: Stagewire) -> None:
    result = stagewire("doctor", "virtual://BBD102")
    assert result.code == 0
    assert result.out.startswith("fine   virtual://BBD102: answers: BBD102")
    words = " ".join(result.out.split())
    assert "bays with a module: 1, 2 " in words
    assert words.endswith(
        "in Python: from stagewire_apt import BBD102; bbd102 = BBD102.open('virtual://BBD102')"
    )


def test_lines_are_wrapped_at_the_width_of_a_terminal(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stagewire_cli.output._PIPE_WIDTH", 40)
    lines = stagewire("doctor", "virtual://TDC001").out.splitlines()
    assert len(lines) > 3
    assert all(len(line) <= 40 for line in lines)


def test_an_unexpected_unit_is_reported(stagewire: Stagewire) -> None:
    result = stagewire("doctor", "virtual://TDC001", "--unit", "tst001")
    assert result.code == 1
    assert "the wrong unit answers: TDC001" in result.out


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("socket://127.0.0.1:1", "refused"),
        ("/dev/there-is-none", "/dev/there-is-none"),
        ("virtual://FLY001", "FLY001"),
        ("nonsense://x", "nonsense"),
    ],
)
def test_a_line_that_cannot_be_opened_is_an_error(
    stagewire: Stagewire, url: str, said: str
) -> None:
    result = stagewire("doctor", url)
    assert result.code == 1
    assert result.out.startswith(f"WRONG  {url}: ")
    assert said in result.out.removeprefix(f"WRONG  {url}: ") or said in url


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--unit", "TDC001"], "requires a URL"),
        (["virtual://TDC001", "--unit", "TDC01"], "did you mean TDC001"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str], said: str) -> None:
    result = stagewire("doctor", *arguments)
    assert result.code == 2
    assert said in result.err

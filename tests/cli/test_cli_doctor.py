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
    first, advice = result.out.splitlines()
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
    fine, use, note, advice = result.out.splitlines()
    assert use == f"       from stagewire_apt import TDC001; next: stagewire monitor {device}"
    assert fine == f"fine   {device}: TDC001: One-channel T-Cube DC servo driver"
    assert note.startswith("note   /dev/ttyS0: unknown")
    assert "stagewire doctor /dev/ttyS0" in advice


def test_a_controller_that_answers_is_fine(stagewire: Stagewire) -> None:
    result = stagewire("doctor", "virtual://BBD102")
    assert result.code == 0
    assert result.out.startswith("fine   virtual://BBD102: answers: BBD102")
    assert "bays with a module: 1, 2\n" in result.out
    assert (
        "from stagewire_apt import BBD102; next: stagewire monitor virtual://BBD102" in result.out
    )


def test_a_serial_number_in_place_of_a_port_gets_its_url(stagewire: Stagewire) -> None:
    for command in (["doctor"], ["move", "--by", "1", "--yes"], ["monitor"]):
        result = stagewire(*command, "27000001")
        assert result.code != 0
        assert "If 27000001 is a serial number, open usb://27000001" in result.out + result.err


def test_the_advice_names_options_of_the_command(stagewire: Stagewire) -> None:
    url = "virtual://KDC101"
    result = stagewire("move", url, "--address", "0x51", "--to", "1", "--yes")
    assert result.err.endswith("Sources also reach a KDC101 at 0x50: choose one with --address\n")
    assert "identify=" not in result.err
    result = stagewire("move", "virtual://TDC001", "--to", "1", "--yes")
    assert "give --stage NAME" in result.err
    assert "Stage.of_user" not in result.err


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

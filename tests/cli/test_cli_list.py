"""``stagewire list``: ports, controllers and exit codes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from serial_ports import linux, port, show
from stagewire_cli import output

if TYPE_CHECKING:
    from conftest import Stagewire


def test_controllers_and_other_ports_are_listed(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    show(monkeypatch, port("/dev/ttyS0"), linux("/dev/ttyUSB0", "83828433"))
    result = stagewire("list")
    assert (result.code, result.err) == (0, "")
    controller, other = result.out.splitlines()[2:]
    assert "TDC001" in controller
    assert "83828433" in controller
    assert other.startswith("/dev/ttyS0")
    assert "unknown" in other


def test_a_controller_of_the_later_issue_is_named(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "29250000"))
    said = stagewire("list").out
    assert "KPZ101: One-channel K-Cube piezo driver" in said


def test_ports_are_listed_as_json(stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "73828433"), port("/dev/ttyS0"))
    first, second = (json.loads(line) for line in stagewire("list", "--json").out.splitlines())
    assert first["units"] == ["BBD102", "BBD103"]
    assert first["unit"] is None
    assert first["usb"] == "0403:faf0"
    assert first["controller"] is True
    assert (second["url"], second["controller"], second["usb"]) == ("/dev/ttyS0", False, "")


@pytest.mark.parametrize("others", [[], [port("/dev/ttyS0")]], ids=["no port", "another port"])
def test_without_a_controller_the_doctor_is_suggested(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, others: list[object]
) -> None:
    show(monkeypatch, *others)
    result = stagewire("list")
    assert result.code == 0
    assert "stagewire doctor" in result.err


def test_the_name_of_a_device_cannot_control_the_terminal(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "\x1b[2J99"))
    result = stagewire("list")
    assert "\x1b" not in result.out
    assert "\\x1b[2J99" in result.out


@pytest.mark.parametrize("width", [40, 80])
@pytest.mark.parametrize(
    "arguments",
    [
        ["list"],
        ["show"],
        ["show", "MOT_SET_VELPARAMS"],
        ["show", "jog_mode"],
        ["decode", "53 04 06 00 D0 01 01 00 40 0D 03 00"],
        ["conformance", "device", "--unit", "TDC001", "--list"],
        ["virtual", "--list"],
    ],
)
def test_tables_fit_a_narrow_terminal_and_keep_all_words(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, arguments: list[str], width: int
) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "83000001"), port("/dev/ttyS0"))
    wide = stagewire(*arguments)
    monkeypatch.setattr(output, "_PIPE_WIDTH", width)
    narrow = stagewire(*arguments)
    assert narrow.code == wide.code == 0
    written = "".join(narrow.out.split())
    assert all(word in written for word in wide.out.split() if word.isalnum())
    if arguments[0] in ("list", "conformance"):
        assert max(map(len, narrow.out.splitlines())) <= width

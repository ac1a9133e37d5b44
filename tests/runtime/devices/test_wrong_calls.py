"""Calls with wrong arguments and attributes that do not exist: the errors say what to use instead."""

from __future__ import annotations

import inspect
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import BadValueError
from stagewire_apt import BBD102, BSC002, TDC001, aio, devices
from stagewire_ms2000 import MS2000


@pytest.mark.parametrize("cls", [TDC001, BBD102, aio.TDC001])
def test_a_class_called_with_a_url_points_to_open(cls: Any) -> None:
    with pytest.raises(BadValueError, match=rf"use {cls.__name__}\.open\('/dev/ttyUSB0'\)"):
        cls("/dev/ttyUSB0")


WRONG = [
    ("move_absolute", (1,), {}, "move_absolute: too many positional arguments"),
    ("move_absolute", (), {"um": 1}, "got an unexpected keyword argument 'um'"),
    ("start_move_absolute", (), {"um": 1}, "it takes counts=, mm=, deg=)"),
    ("move_absolute", (), {"um": 1}, "it takes counts=, mm=, deg=, timeout=)"),
    ("home", (1,), {}, "home: too many positional arguments (it takes timeout=)"),
    ("subscribe", (), {"size": 1}, "it takes wanted, limit=)"),
]


@pytest.mark.parametrize(("name", "given", "named", "text"), WRONG)
def test_wrong_arguments_are_answered_with_those_that_fit(
    name: str, given: tuple[object, ...], named: dict[str, object], text: str
) -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line) as tdc:
        line.forget()
        with pytest.raises(BadValueError) as raised:
            getattr(tdc, name)(*given, **named)
        assert text in str(raised.value)
        assert line.raw == b""


def test_a_type_error_inside_a_call_is_not_taken_for_a_wrong_call() -> None:
    class Broken(TDC001):
        def greet(self) -> None:
            raise TypeError("not about arguments")

    with (
        Broken.open("virtual://TDC001") as tdc,
        pytest.raises(TypeError, match="not about arguments"),
    ):
        tdc.greet()


def test_the_signature_of_a_call_is_kept() -> None:
    assert list(inspect.signature(TDC001.home).parameters) == ["self", "timeout"]
    assert "stage" in inspect.signature(TDC001.open).parameters


def test_calls_of_a_part_are_found_there() -> None:
    for device, text in (
        (BBD102.open("virtual://BBD102"), r"BBD102 has no home; use bay\(1\)\.home"),
        (BSC002.open("virtual://BSC002"), r"BSC002 has no home; use channel\(1\)\.home"),
        (MS2000.open("virtual://MS2000"), r"MS2000 has no is_moving; use axis\('X'\)\.is_moving"),
    ):
        with device, pytest.raises(AttributeError, match=text):
            getattr(device, text.split()[3].rstrip(";"))


def test_an_unknown_attribute_is_an_attribute_error() -> None:
    with TDC001.open("virtual://TDC001") as tdc:
        with pytest.raises(AttributeError, match=r"^TDC001 has no nonsense$"):
            _ = tdc.nonsense  # type: ignore[attr-defined]
        assert not hasattr(tdc, "bay")


def test_only_modules_have_a_bay() -> None:
    with pytest.raises(BadValueError, match="bay: a TDC001 is not a module of a rack"):
        TDC001.open("virtual://TDC001", bay=1)
    with devices.MST601.open("virtual://rack?bays=MST601") as module:
        assert module.channel(1).is_moving() is False

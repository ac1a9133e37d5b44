"""Completion by jedi, which IPython, Jupyter and many editors use."""

from __future__ import annotations

import jedi
import pytest

PACKAGES = ["stagewire_apt", "stagewire_apt.aio"]


def complete(code: str) -> set[str]:
    """Return the completions at the end of a program."""
    lines = code.splitlines()
    return {one.name for one in jedi.Script(code).complete(len(lines), len(lines[-1]))}


def open_of(code: str) -> jedi.api.classes.Signature:
    """Return the signature of the call that a program ends with."""
    lines = code.splitlines()
    [found] = jedi.Script(code).get_signatures(len(lines), len(lines[-1]))
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_units_are_completed(package: str) -> None:
    assert {"TDC001", "TST001"} <= complete(f"import {package} as apt\napt.T")


@pytest.mark.parametrize("package", PACKAGES)
def test_calls_of_a_class_are_completed(package: str) -> None:
    assert {"open", "home", "stop"} <= complete(f"from {package} import TDC001\nTDC001.")


def test_calls_of_an_open_device_are_completed() -> None:
    program = "from stagewire_apt import TDC001\n{}.open('COM3'){}"
    for code in (program.format("tdc = TDC001", "\ntdc."), program.format("TDC001", ".")):
        assert {"home", "move_absolute", "is_moving"} <= complete(code)


def test_calls_of_a_device_in_a_with_block_are_completed() -> None:
    code = "from stagewire_apt import TDC001\nwith TDC001.open('COM3') as tdc:\n    tdc."
    assert {"home", "move_absolute", "is_moving"} <= complete(code)


@pytest.mark.parametrize("package", PACKAGES)
def test_options_of_open_are_completed_and_documented(package: str) -> None:
    code = f"from {package} import TDC001\nTDC001.open("
    assert {"stage=", "stages="} <= complete(f"{code}sta")
    signature = open_of(code)
    names = {parameter.name for parameter in signature.params}
    assert {"url", "stage", "travel_mm", "serial_number", "timeout", "on_close"} <= names
    text = signature.docstring()
    assert all(f":param {name}:" in text for name in names)


def test_names_of_the_library_are_completed() -> None:
    assert {"open", "discover", "errors", "Stage"} <= complete("import stagewire\nstagewire.")

"""Completion in an editor: names, types, units and ranges, from pyright's language server."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import npm
from language_server import LanguageServer

pytestmark = pytest.mark.matrix

HERE = Path(__file__).parent
SETTINGS = {"python": {"pythonPath": sys.executable}}


@pytest.fixture(scope="module")
def server() -> Iterator[LanguageServer]:
    program = npm.node_modules(HERE) / "pyright" / "langserver.index.js"
    with LanguageServer(program, "python", SETTINGS) as it:
        yield it


@pytest.fixture(params=["stagewire_apt", "stagewire_apt.aio"])
def program(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    """A file, and a text with an incomplete line; ``|`` marks the cursor and is not in the text."""
    lines = [f"from {request.param} import TDC001", "def use(tdc: TDC001) -> None:", "    tdc."]
    return tmp_path / "program.py", "\n".join(lines)


def place(text: str) -> tuple[int, int]:
    """Return the end of a text as line and character, counted from 0."""
    return text.count("\n"), len(text.rpartition("\n")[2])


def completion(server: LanguageServer, path: Path, text: str, close: str = "") -> set[str]:
    """Return the completions at the end of a text, before the closing text."""
    server.open(path, text + close)
    return set(server.completion(path, *place(text)))


def test_methods_are_completed(server: LanguageServer, program: tuple[Path, str]) -> None:
    path, text = program
    offered = completion(server, path, text)
    assert {"home", "move_absolute", "set_vel_params", "get_dc_status_update", "stop"} <= offered
    assert not {"set_output_volts", "bay", "channel"} & offered


def test_keywords_have_their_units(server: LanguageServer, program: tuple[Path, str]) -> None:
    path, text = program
    offered = completion(server, path, f"{text}set_vel_params(", ")")
    assert {"max_velocity=", "max_velocity_mm_per_s=", "acceleration_mm_per_s2="} <= offered


def test_help_on_a_method_has_types_ranges_and_the_page(
    server: LanguageServer, program: tuple[Path, str]
) -> None:
    path, text = program
    server.open(path, f"{text}set_vel_params()")
    shown = server.hover(path, *place(f"{text}s")).replace("\\", "")
    assert "max_velocity_mm_per_s: Number | None = None" in shown
    assert "0 to 4294967295" in shown
    assert "`MOT_SET_VELPARAMS`, Issue 3, page 30" in shown

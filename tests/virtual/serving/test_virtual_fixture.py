"""The fixture ``virtual`` in the tests of a user."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from stagewire_apt import stages
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.pytest_plugin import Controllers

USERS = """
import threading
import pytest
from stagewire_apt import stages

made = []

def test_first(virtual):
    tdc = virtual.TDC001(stage=stages.Z8)
    made.append(tdc)
    tdc.write(bytes.fromhex("05 00 00 00 50 01"))
    assert tdc.read_frames()[0].frame.message.model_number == "TDC001"
    made.append(tdc.tcp())
    made.append(virtual.rack("MST601", None))

def test_second_finds_them_closed():
    tdc, served, rack = made
    for closed in (tdc, rack):
        with pytest.raises(Exception, match="unplugged"):
            closed.write(b"")
    assert "(closed)" in repr(served)
    assert all(thread.name != "stagewire-virtual" for thread in threading.enumerate())
"""


def test_the_fixture_has_the_names_of_the_package(virtual: Controllers) -> None:
    tdc = virtual.TDC001(stage=stages.Z8)
    assert isinstance(tdc, VirtualController)
    clock = virtual.SteppedClock()
    assert virtual.TSC001(clock=clock).clock is clock
    with pytest.raises(AttributeError, match="did you mean TDC001"):
        virtual.TDC01  # noqa: B018


def test_controllers_of_the_fixture_are_closed_at_the_end() -> None:
    from contextlib import ExitStack

    with ExitStack() as stack:
        tdc = Controllers(stack).TDC001()
        tdc.write(b"")
    with pytest.raises(UnpluggedError):
        tdc.write(b"")


def run(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")}
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment | variables,
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_pytest_finds_the_fixture_in_the_tests_of_a_user(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text('pytest_plugins = ["stagewire_virtual.pytest_plugin"]\n')
    (tmp_path / "test_mine.py").write_text(USERS)
    words = ("-m", "pytest", "-q", "-W", "error", "-p", "no:cacheprovider")
    done = run(tmp_path, *words, PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")  # others are slow to import
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout


@pytest.mark.matrix
def test_pytest_without_the_plugin_imports_nothing_of_stagewire(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(
        "import sys\n"
        "def test_nothing():\n"
        "    ours = {name for name in sys.modules if name.startswith('stagewire')}\n"
        "    assert not ours, ours\n"
    )
    done = run(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist")
    assert done.returncode == 0, done.stdout + done.stderr

"""Packages import and tests are collected without the POSIX modules that Windows lacks."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from checkout import ROOT, TESTS
from systems import NEEDS, pytest_collection_modifyitems

PACKAGES = (
    "stagewire",
    "stagewire_apt",
    "stagewire_ms2000",
    "stagewire_generator",
    "stagewire_virtual",
    "stagewire_conformance",
    "stagewire_cli",
)

# Import the standard library and pyserial first: they choose their own modules for the system.
HIDE = """
import asyncio, multiprocessing.util, os, select, signal, socketserver, subprocess, sys
import serial, serial.rfc2217, serial.tools.list_ports, serial.urlhandler.protocol_loop

def hide():
    for name in ("fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"):
        sys.modules[name] = None
    for module, names in {
        os: "fork openpty setsid killpg getuid getgid mkfifo sched_getaffinity ttyname WNOHANG",
        select: "poll",
        signal: "SIGALRM SIGCHLD SIGHUP SIGKILL SIGPIPE SIGQUIT SIGUSR1 SIGUSR2 alarm setitimer",
    }.items():
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
"""

IMPORT_ALL = """
import importlib, pkgutil
hide()
count = 0
for package in sys.argv[1:]:
    top = importlib.import_module(package)
    for module in pkgutil.walk_packages(top.__path__, f"{package}."):
        importlib.import_module(module.name)
        count += 1
print(count)
"""

COLLECT = """
import pytest

class Hidden:
    def pytest_sessionstart(self):
        hide()

options = ["--collect-only", "-qq", "-p", "no:cacheprovider", "-p", "no:xdist"]
sys.exit(pytest.main([*options, *sys.argv[1:]], plugins=[Hidden()]))
"""


def python(program: str, *arguments: object) -> str:
    """Run a program that can hide modules; return its output."""
    done = subprocess.run(
        [sys.executable, "-c", HIDE + program, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-5000:]
    return done.stdout


def test_every_module_imports_without_posix_modules() -> None:
    assert int(python(IMPORT_ALL, *PACKAGES)) > 400


@pytest.mark.matrix
def test_the_tests_are_collected_without_posix_modules() -> None:
    assert "tests/runtime/links/test_link_opening.py: " in python(COLLECT)


@pytest.mark.parametrize("row", NEEDS)
def test_every_row_of_the_table_names_an_existing_test(row: str) -> None:
    name, _, test = row.partition("::")
    path = TESTS / name
    assert path.is_dir() if name.endswith("/") else path.is_file()
    assert not test or f"\ndef {test}(" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("system", "skipped"),
    [("linux", []), ("darwin", ["c"]), ("win32", ["c", "names", "pipe"])],
)
def test_tests_that_a_system_cannot_run_are_skipped(
    system: str, skipped: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[str] = []
    pipe = "test_a_pipe_in_the_place_of_a_file_is_refused"
    tests = {
        "c": ("generated/c/test_c_compile.py", "test_it", "test_it[gcc]"),
        "names": ("injection/test_injected_files.py", "test_it", "test_it"),
        "pipe": ("generator/test_output.py", pipe, f"{pipe}[a/one.py]"),
        "other": ("generator/test_output.py", "test_it", "test_it"),
    }
    items: list[Any] = [
        SimpleNamespace(
            path=TESTS / path, originalname=test, name=name, add_marker=lambda _, key=key: found.append(key)
        )
        for key, (path, test, name) in tests.items()
    ]  # fmt: skip
    monkeypatch.setattr(sys, "platform", system)
    pytest_collection_modifyitems(items)
    monkeypatch.undo()
    assert found == skipped

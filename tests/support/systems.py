"""Skip tests that a system cannot run, with the reason.

A test that needs a compiler, a shell or a system call has a row in this table or a ``skipif`` mark. Linux
runs every row.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from checkout import TESTS

LINUX = ("linux",)
POSIX = ("linux", "darwin")

NEEDS = {
    "packaging/build_systems/": (LINUX, "runs make, CMake and the compilers of Linux"),
    "generated/c/": (LINUX, "runs the compilers, emulators and checkers of Linux"),
    "control/test_epics_network.py": (LINUX, "requires network namespaces of Linux"),
    "fuzz/": (POSIX, "limits the time of a case with SIGALRM"),
    "generator/change/test_change_revision.py::test_broken_git_is_reported": (
        POSIX,
        "requires file modes",
    ),
    "generator/formatting/test_formatting_files.py::test_a_file_keeps_its_mode_and_leaves_no_other_file": (
        POSIX,
        "requires file modes",
    ),
    "generator/test_output.py::test_a_pipe_in_the_place_of_a_file_is_refused": (
        POSIX,
        "requires named pipes",
    ),
    "generator/targets/test_templates.py::test_all_problems_with_files_are_reported": (
        POSIX,
        "requires named pipes",
    ),
    "injection/test_injected_files.py": (POSIX, "Windows does not allow these file names"),
    "project/test_demo.py": (POSIX, "requires make and a POSIX shell"),
    "packaging/test_third_party.py::test_the_c_code_of_the_project_compiles": (
        LINUX,
        "runs gcc and g++",
    ),
    "packaging/test_third_party.py::test_the_testee_in_c_answers_as_the_one_in_python": (
        LINUX,
        "runs gcc",
    ),
    "documentation/walkthrough/": (POSIX, "requires bash and Perl"),
}
"""Folder, file or test below ``tests/`` -> the systems that run it, and the reason to skip it on others."""


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Ignore the C tests on Windows: their processes share build results through ``fcntl``."""
    return (
        True if collection_path == TESTS / "generated" / "c" and not _installed("fcntl") else None
    )


def _installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ValueError:  # a test has hidden it
        return False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests that this system cannot run."""
    refused = {row: why for row, (systems, why) in NEEDS.items() if sys.platform not in systems}
    for item in items:
        if item.path.is_relative_to(TESTS):
            path = item.path.relative_to(TESTS).as_posix()
            test = f"{path}::{getattr(item, 'originalname', item.name)}"
            for row, why in refused.items():
                if row in (path, test) or (row.endswith("/") and path.startswith(row)):
                    item.add_marker(pytest.mark.skip(reason=why))

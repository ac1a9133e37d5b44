"""The generated C, and the compilers that test it."""

from __future__ import annotations

import functools
import os
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
import tools
from generated_c import generated

C = generated()
"""The folder of the packages and their tests."""

WARNINGS = [
    *("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow"),
    *("-Wcast-qual", "-Wcast-align", "-Wundef", "-Werror"),
]
C_WARNINGS = [*WARNINGS, "-Wstrict-prototypes"]  # not supported in C++
C_STANDARDS = ("c99", "c11", "c17")
CORTEX_M0 = ["-mcpu=cortex-m0", "-mthumb", "-Os", "-ffreestanding"]

_FUNCTION = re.compile(r"^static inline [\w *]*?(\w+)\(", re.MULTILINE)


def need(*names: str) -> None:
    """Skip the test if a tool is missing, with a message on how to install it."""
    reason = tools.why_not(names)
    if reason:
        pytest.skip(reason)


def run(
    *words: object, cwd: Path | None = None, timeout: float = 600, **more: str
) -> subprocess.CompletedProcess[str]:
    """Run a program and return the result; standard error is part of the output."""
    return subprocess.run(
        [*map(str, words)],
        cwd=cwd,
        env={**os.environ, "LC_ALL": "C.UTF-8", **more},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        timeout=timeout,
        check=False,
    )


def compiles(*words: object, cwd: Path | None = None) -> str:
    """Run a compiler that must succeed without messages, and return its output."""
    done = run(*words, cwd=cwd)
    assert done.returncode == 0, f"{' '.join(map(str, words))}\n{done.stdout}"
    return done.stdout


class Package:
    """The folder of one protocol below :data:`C`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.name = folder.name
        self.prefix = folder.name.removeprefix("stagewire_")
        self.umbrella = folder / f"{folder.name}.h"
        self.source = folder / f"{folder.name}.c"

    def headers(self) -> list[Path]:
        """Return the headers for users, without those of test programs."""
        inside = self.folder.rglob("*.h")
        return sorted(path for path in inside if "testing" not in path.parts)

    @functools.cached_property
    def text(self) -> str:
        """The text of all headers as a compiler reads it when none of their macros is defined."""
        need("gcc")
        beside = f"-I{self.folder.parent}"
        command = ["gcc", "-std=c99", "-ffreestanding", "-E", "-P", beside, "-x", "c", "-"]
        every = "".join(map(self.include, self.headers()))
        done = subprocess.run(command, input=every, capture_output=True, text=True, check=True)
        return done.stdout

    def functions(self) -> list[str]:
        """Return the names of all functions of the headers that are ``static inline``."""
        return _FUNCTION.findall(self.text)

    def layouts(self) -> list[str]:
        """Return the names of all layouts, with the prefix."""
        functions = set(self.functions())
        return sorted(
            name.removesuffix("_encode")
            for name in functions
            if name.endswith("_encode") and name.removesuffix("_encode") + "_decode" in functions
        )

    def include(self, path: Path) -> str:
        """Return the include line of a header."""
        return f'#include "{path.relative_to(self.folder.parent).as_posix()}"\n'


def packages() -> list[Package]:
    """Return the packages of all protocols with generated C."""
    umbrellas = sorted(C.glob("*/*.h"))
    return [Package(path.parent) for path in umbrellas if path.stem == path.parent.name]


def of_each_package(test: object) -> object:
    """Run a test once for every protocol."""
    return pytest.mark.parametrize("package", packages(), ids=lambda it: it.prefix)(test)


def symbols(nm: str, path: Path) -> list[tuple[str, str, int]]:
    """Return name, kind and size of the symbols of an object file."""
    rows: list[tuple[str, str, int]] = []
    for line in compiles(nm, "--print-size", "--radix=d", path).splitlines():
        words: Sequence[str] = line.split()
        size = int(words[1]) if len(words) == 4 else 0
        rows.append((words[-1], words[-2], size))
    return rows

"""The programs that the tests of the C target need, and their Debian packages.

    python3 tests/generated/c/tools.py            # print missing tools; exit status 1 if there are any
    python3 tests/generated/c/tools.py install    # install them if that needs no password; exit status 0

``make test`` runs the second command before there is an environment, so only the standard library is used.
Tools that cannot be installed are printed with the command that installs them. Tests that need them are
skipped with the same message. CI fails on a skip.
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple


class Tool(NamedTuple):
    """A tool, the packages that contain it, and how to detect it."""

    packages: tuple[str, ...]
    links: tuple[str, ...] = ()
    """A compiler with options that must link an empty program; otherwise the name is a program."""


TOOLS = {
    "gcc": Tool(("gcc", "libc6-dev")),
    "g++": Tool(("g++",)),
    "clang": Tool(("clang",)),
    "clang++": Tool(("clang",)),
    "clang-tidy": Tool(("clang-tidy",)),
    "clang-format": Tool(("clang-format",)),
    "cppcheck": Tool(("cppcheck",)),
    "doxygen": Tool(("doxygen",)),
    "valgrind": Tool(("valgrind",)),
    "arm-none-eabi-gcc": Tool(("gcc-arm-none-eabi",)),
    "qemu-system-arm": Tool(("qemu-system-arm",)),
    "s390x-linux-gnu-gcc": Tool(("gcc-s390x-linux-gnu", "libc6-dev-s390x-cross")),
    "qemu-s390x": Tool(("qemu-user",)),
    # gcc-multilib contains the libraries for -m32 under one name, but it conflicts with every
    # cross compiler; so this is the library for the version of gcc.
    "gcc -m32": Tool(("libc6-dev-i386", "lib32gcc-{gcc}-dev"), ("gcc", "-m32")),
    "clang -fsanitize": Tool(
        ("libclang-rt-dev",), ("clang", "-fsanitize=address,undefined,fuzzer-no-link")
    ),
}


@functools.cache
def is_there(name: str) -> bool:
    """Whether a tool of :data:`TOOLS` is available."""
    links = TOOLS[name].links
    if not links:
        return shutil.which(name) is not None
    if shutil.which(links[0]) is None:
        return False
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "empty.c"
        source.write_text("int main(void) { return 0; }\n", encoding="ascii")
        command = [*links, str(source), "-o", str(Path(folder) / "empty")]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0


def missing(names: Iterable[str] = TOOLS) -> list[str]:
    """Return the missing tools."""
    return [name for name in names if not is_there(name)]


def packages(names: Iterable[str]) -> list[str]:
    """Return the packages of the tools, each once."""
    version = _version_of_gcc()
    wanted = (package for name in names for package in TOOLS[name].packages)
    return list(dict.fromkeys(package.format(gcc=version) for package in wanted))


def _version_of_gcc() -> str:
    if shutil.which("gcc") is None:
        return "VERSION"
    asked = subprocess.run(["gcc", "-dumpversion"], capture_output=True, text=True, check=True)
    return asked.stdout.strip().partition(".")[0]


def why_not(names: Sequence[str]) -> str:
    """Return a message with the missing tools and how to install them; empty if there are none."""
    absent = missing(names)
    if not absent:
        return ""
    return f"{', '.join(absent)} missing; on Debian: apt-get install {' '.join(packages(absent))}"


# Installing


def _privilege() -> list[str] | None:
    """Return the command before apt-get, or None if it cannot run without a password."""
    if shutil.which("apt-get") is None:
        return None
    if os.geteuid() == 0:
        return []
    sudo = ["sudo", "--non-interactive"]
    may = shutil.which("sudo") and subprocess.run([*sudo, "true"], capture_output=True).returncode
    return sudo if may == 0 else None


def _install(names: Sequence[str], privilege: Sequence[str]) -> None:
    apt = [*privilege, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]
    words = ["install", "--yes", "--no-install-recommends", *packages(names)]
    print(f"== installing {' '.join(packages(names))}", flush=True)
    subprocess.run([*apt, "update"], check=False)
    subprocess.run([*apt, *words], check=False)
    is_there.cache_clear()


def main(arguments: Sequence[str]) -> int:
    """Install the missing tools, or only print them."""
    if list(arguments) not in ([], ["install"]):
        print(__doc__)
        return 2
    if not arguments:
        print(why_not(list(TOOLS)) or "all are there")
        return 1 if missing() else 0
    privilege = _privilege()
    # The first round installs gcc, whose version decides on a package of the second.
    for names in (["gcc"], list(TOOLS)):
        absent = missing(names)
        if absent and privilege is not None:
            _install(absent, privilege)
    if missing():
        print(f"tests of the C target will be skipped: {why_not(list(TOOLS))}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

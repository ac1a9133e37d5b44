"""Tools that are missing are installed where that is possible, and named where it is not."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
import toolchain
import tools


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A machine without any of the tools; its apt-get notes what it is told."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    program(folder, "env", 'shift; exec "$@"')
    program(folder, "apt-get", f'echo "$@" >> "{tmp_path}/told"')
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    tools.is_there.cache_clear()
    yield tmp_path
    tools.is_there.cache_clear()


def program(folder: Path, name: str, text: str) -> None:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="ascii")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def told(machine: Path) -> list[str]:
    path = machine / "told"
    return path.read_text(encoding="ascii").splitlines() if path.exists() else []


def test_all_that_is_missing_is_installed(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tools.main(["install"]) == 0
    update, gcc, again, rest = told(bare)
    assert (update, again) == ("update", "update")
    assert gcc == "install --yes --no-install-recommends gcc libc6-dev"
    assert {"clang", "gcc-arm-none-eabi", "qemu-user", "doxygen"} <= set(rest.split())
    assert "gcc-multilib" not in rest, "it conflicts with every cross compiler"
    assert "tests of the C target will be skipped" in capsys.readouterr().out


def test_the_library_for_32_bits_is_that_of_gcc(bare: Path) -> None:
    program(bare / "bin", "gcc", "test $1 = -dumpversion && echo 12")
    assert tools.packages(["gcc -m32"]) == ["libc6-dev-i386", "lib32gcc-12-dev"]


def test_without_the_right_to_install_it_is_said(
    bare: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert tools.main(["install"]) == 0
    assert told(bare) == []
    said = capsys.readouterr().out
    assert "valgrind" in said
    assert "apt-get install" in said


def test_sudo_is_used_where_it_asks_no_password(
    bare: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    program(bare / "bin", "true", "exit 0")
    program(bare / "bin", "sudo", 'shift; exec "$@"')
    assert tools.main(["install"]) == 0
    assert told(bare)[0] == "update"
    program(bare / "bin", "sudo", "exit 1")
    before = told(bare)
    assert tools.main(["install"]) == 0
    assert told(bare) == before


def test_a_machine_without_apt_get_is_told_what_debian_calls_it(bare: Path) -> None:
    (bare / "bin" / "apt-get").unlink()
    assert tools.main(["install"]) == 0
    assert (
        tools.why_not(["qemu-s390x"]) == "qemu-s390x missing; on Debian: apt-get install qemu-user"
    )


def test_a_test_without_its_tool_is_skipped_in_the_same_words(bare: Path) -> None:
    with pytest.raises(pytest.skip.Exception, match="apt-get install cppcheck"):
        toolchain.need("cppcheck")


def test_what_is_there_is_left_alone(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, tool in tools.TOOLS.items():
        program(
            bare / "bin", (tool.links or (name,))[0], 'test "$1" = -dumpversion && echo 12; exit 0'
        )
    tools.is_there.cache_clear()
    assert tools.main(["install"]) == 0
    assert told(bare) == []
    assert capsys.readouterr().out == ""
    assert tools.main([]) == 0

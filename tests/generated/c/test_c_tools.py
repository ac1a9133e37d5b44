"""Missing tools are installed if possible, and otherwise named."""

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
    """A machine without any of the tools; its apt-get records its arguments."""
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


def test_all_missing_tools_are_installed(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tools.main(["install"]) == 0
    update, gcc, again, rest = told(bare)
    assert (update, again) == ("update", "update")
    assert gcc == "install --yes --no-install-recommends gcc libc6-dev"
    assert {"clang", "gcc-arm-none-eabi", "qemu-user", "doxygen"} <= set(rest.split())
    assert "gcc-multilib" not in rest, "it conflicts with every cross compiler"
    assert "tests of the C target will be skipped" in capsys.readouterr().out


def test_the_library_for_32_bits_matches_gcc(bare: Path) -> None:
    program(bare / "bin", "gcc", "test $1 = -dumpversion && echo 12")
    assert tools.packages(["gcc -m32"]) == ["libc6-dev-i386", "lib32gcc-12-dev"]


def test_missing_privileges_are_reported(
    bare: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert tools.main(["install"]) == 0
    assert told(bare) == []
    said = capsys.readouterr().out
    assert "valgrind" in said
    assert "apt-get install" in said


def test_sudo_is_used_if_it_needs_no_password(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    program(bare / "bin", "true", "exit 0")
    program(bare / "bin", "sudo", 'shift; exec "$@"')
    assert tools.main(["install"]) == 0
    assert told(bare)[0] == "update"
    program(bare / "bin", "sudo", "exit 1")
    before = told(bare)
    assert tools.main(["install"]) == 0
    assert told(bare) == before


def test_without_apt_get_the_debian_packages_are_named(bare: Path) -> None:
    (bare / "bin" / "apt-get").unlink()
    assert tools.main(["install"]) == 0
    assert (
        tools.why_not(["qemu-s390x"]) == "qemu-s390x missing; on Debian: apt-get install qemu-user"
    )


def test_a_skipped_test_has_the_same_message(bare: Path) -> None:
    with pytest.raises(pytest.skip.Exception, match="apt-get install cppcheck"):
        toolchain.need("cppcheck")


def test_installed_tools_are_not_changed(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, tool in tools.TOOLS.items():
        program(
            bare / "bin", (tool.links or (name,))[0], 'test "$1" = -dumpversion && echo 12; exit 0'
        )
    tools.is_there.cache_clear()
    assert tools.main(["install"]) == 0
    assert told(bare) == []
    assert capsys.readouterr().out == ""
    assert tools.main([]) == 0

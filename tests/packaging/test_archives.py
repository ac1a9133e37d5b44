"""The archives of a release: their content, and a C archive that needs nothing else."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from types import ModuleType

import pytest

import stagewire
from checkout import ROOT
from files import import_program
from markdown_blocks import blocks
from stagewire.protocols import load_protocol
from stagewire_generator import check, render

EPOCH = 1_700_000_000
PROGRAM = ROOT / "tools" / "archives.py"
PACKAGES = {"stagewire_apt": "thorlabs_apt", "stagewire_ms2000": "asi_ms2000"}


@pytest.fixture(scope="module")
def archives() -> ModuleType:
    """The program that builds the archives."""
    return import_program(PROGRAM)


@pytest.fixture(scope="module")
def packed(archives: ModuleType) -> bytes:
    """The C archive."""
    return bytes(archives.c_archive(EPOCH))


def members(packed: bytes) -> list[tarfile.TarInfo]:
    with tarfile.open(fileobj=io.BytesIO(packed), mode="r:gz") as archive:
        return archive.getmembers()


def content(packed: bytes, path: str) -> bytes:
    with tarfile.open(fileobj=io.BytesIO(packed), mode="r:gz") as archive:
        found = archive.extractfile(f"stagewire-c-{stagewire.__version__}/{path}")
        assert found is not None
        return found.read()


def test_the_c_archive_has_the_expected_files(packed: bytes) -> None:
    top = f"stagewire-c-{stagewire.__version__}"
    names = [member.name.removeprefix(f"{top}/") for member in members(packed)]
    made = render(check(ROOT / "spec"), ["c", "c-tests"])
    json_files = {
        f"{kind}/{name}.json" for kind in ("registry", "vectors") for name in PACKAGES.values()
    }
    assert set(names) == {
        *made,
        *json_files,
        "LICENSE",
        "docs/reference/c.md",
        "docs/reference/vectors.md",
    }
    assert {"c/stagewire_apt/testing/cases.c", "c/testing/testee/testee.c"} <= set(names)
    for package in PACKAGES:
        committed = (ROOT / "generated" / "c" / package / f"{package}.c").read_bytes()
        assert content(packed, f"c/{package}/{package}.c") == committed


def test_the_json_in_the_c_archive_equals_that_of_the_packages(packed: bytes) -> None:
    for name in PACKAGES.values():
        protocol = load_protocol(name)
        assert json.loads(content(packed, f"registry/{name}.json")) == protocol.registry()
        assert json.loads(content(packed, f"vectors/{name}.json")) == protocol.vectors()


def test_the_same_epoch_gives_the_same_bytes(
    archives: ModuleType, packed: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert archives.c_archive(EPOCH) == packed
    assert {(m.mtime, m.mode, m.uid, m.uname) for m in members(packed)} == {(EPOCH, 0o644, 0, "")}
    assert [m.name for m in members(packed)] == sorted(m.name for m in members(packed))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "12")
    assert archives.epoch() == 12


@pytest.mark.matrix
def test_all_archives_are_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(EPOCH))
    subprocess.run([sys.executable, PROGRAM, "--out", tmp_path], check=True, capture_output=True)
    version = stagewire.__version__
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        f"stagewire-{version}-py3-none-any.whl",
        f"stagewire-{version}.tar.gz",
        f"stagewire-c-{version}.tar.gz",
    ]


@pytest.mark.matrix
@pytest.mark.parametrize("package", PACKAGES)
def test_the_c_archive_passes_its_own_tests(packed: bytes, package: str, tmp_path: Path) -> None:
    """In the unpacked archive, the commands of its page run the vectors, and its other tests pass."""
    if not shutil.which("cc"):
        pytest.skip("cc missing; on Debian: apt-get install gcc libc6-dev")
    with tarfile.open(fileobj=io.BytesIO(packed), mode="r:gz") as archive:
        archive.extractall(tmp_path, filter="data")
    folder = tmp_path / f"stagewire-c-{stagewire.__version__}"
    *_, commands = blocks(folder / "docs" / "reference" / "c.md", "sh")
    testing = f"{package}/testing"
    testee = f"testing/testee/*.c {testing}/layouts.c {testing}/testee.c {package}/{package}.c"
    script = f"""
        {commands.text.replace("stagewire_apt", package)}
        cc -std=c99 -I. -o round_trip testing/failed.c {testing}/round_trip.c && ./round_trip
        cc -std=c99 -I. -o testee {testee} && echo '{{"id":1,"op":"hello"}}' | ./testee
    """
    done = subprocess.run(
        ["sh", "-e", "-c", script], cwd=folder / "c", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    *findings, hello = done.stdout.splitlines()
    assert sum(" 0 failed" in line for line in findings) == 2  # examples and cases
    assert json.loads(hello)["protocols"] == [PACKAGES[package]]

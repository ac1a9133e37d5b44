"""The sdist: pip builds the same wheel from it, and installs the generator only as an extra."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from email.parser import Parser
from pathlib import Path, PurePosixPath

import pytest

import stagewire
from checkout import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
GENERATOR = {"jinja2", "pyyaml", "jsonschema", "jsonschema-rs", "junitparser", "ruamel-yaml"}


def run(*words: object, cwd: Path | None = None) -> str:
    done = subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, cwd=cwd, timeout=600
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def pip(*words: object) -> str:
    quiet = ("--disable-pip-version-check", "--quiet")
    return run(sys.executable, "-m", "pip", *words[:1], *quiet, *words[1:])


@pytest.fixture(scope="session")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An sdist of the working tree."""
    folder = tmp_path_factory.mktemp("sdist")
    run(sys.executable, "-m", "hatchling", "build", "--target", "sdist", "-d", folder, cwd=ROOT)
    (made,) = folder.glob("*.tar.gz")
    return made


@pytest.fixture(scope="session")
def wheels(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Wheels that pip builds from the sdist and from the working tree."""
    made = {}
    for name, source, options in (("sdist", sdist, ()), ("tree", ROOT, ("--no-build-isolation",))):
        folder = tmp_path_factory.mktemp(f"wheel-of-{name}")
        pip("wheel", "--no-deps", *options, "--wheel-dir", folder, source)
        (made[name],) = folder.glob("*.whl")
    return made


def names(sdist: Path) -> set[PurePosixPath]:
    with tarfile.open(sdist) as archive:
        paths = [PurePosixPath(member.name) for member in archive if member.isfile()]
    return {PurePosixPath(*path.parts[1:]) for path in paths}


@pytest.mark.matrix
def test_the_sdist_has_all_folders_and_no_build_products(sdist: Path) -> None:
    found = names(sdist)
    rooms = {path.parts[0] for path in found if len(path.parts) > 1}
    assert rooms >= {
        "spec",
        "generator",
        "runtime",
        "generated",
        "conformance",
        "cli",
        "tests",
        "docs",
    }
    assert not rooms & {".venv", "build", "dist", ".git", ".ci"}
    assert not [path for path in found if {"__pycache__", "compiled"} & {*path.parts}]
    assert not [path for path in found if path.suffix == ".pyc"]
    assert {PurePosixPath(p) for p in ("CHANGELOG.md", "LICENSE", "README.md", "Makefile")} <= found


@pytest.mark.matrix
def test_pip_builds_the_same_wheel_from_the_sdist(wheels: dict[str, Path]) -> None:
    contents = []
    for wheel in wheels.values():
        with zipfile.ZipFile(wheel) as archive:
            contents.append({name: archive.read(name) for name in archive.namelist()})
    assert contents[0] == contents[1]
    assert len(contents[0]) > 100


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("extra", "wanted"), [("", set()), ("[generator]", GENERATOR)], ids=["plain", "generator"]
)
def test_pip_installs_the_generator_dependencies_only_with_the_extra(
    wheels: dict[str, Path], extra: str, wanted: set[str]
) -> None:
    """Dependencies of dependencies are included."""
    options = ("--dry-run", "--ignore-installed", "--report", "-")
    report = json.loads(pip("install", *options, f"{wheels['sdist']}{extra}"))
    installed = {
        re.sub(r"[-_.]+", "-", found["metadata"]["name"]).lower() for found in report["install"]
    }
    assert {"stagewire", "pyserial", "typer", "rich"} <= installed
    assert installed & GENERATOR == wanted


@pytest.mark.matrix
def test_the_wheel_installs_and_runs_without_extras(
    wheels: dict[str, Path], tmp_path: Path
) -> None:
    """The environment has only pip."""
    venv.create(tmp_path / "env", with_pip=True)
    python = shutil.which(
        "python", path=tmp_path / "env" / ("Scripts" if sys.platform == "win32" else "bin")
    )
    run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheels["sdist"])
    command = Path(str(python)).parent / "stagewire"
    assert run(command, "--version") == f"stagewire {stagewire.__version__}\n"
    assert "id 0x0453" in run(command, "show", "MOT_MOVE_ABSOLUTE")
    code = "import importlib.util as u, sys; print([n for n in sys.argv[1:] if u.find_spec(n)])"
    modules = ("jinja2", "yaml", "jsonschema", "jsonschema_rs", "junitparser", "ruamel")
    assert run(python, "-c", code, *modules) == "[]\n"


def test_changelog_project_and_library_have_the_same_version() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## (\S+)", changelog, re.M)
    assert newest is not None
    assert newest[1] == PROJECT["version"] == stagewire.__version__


@pytest.mark.matrix
def test_the_sdist_has_the_version_of_the_project(sdist: Path) -> None:
    with tarfile.open(sdist) as archive:
        info = archive.extractfile(f"stagewire-{PROJECT['version']}/PKG-INFO")
        assert info is not None
        assert Parser().parsestr(info.read().decode())["Version"] == PROJECT["version"]

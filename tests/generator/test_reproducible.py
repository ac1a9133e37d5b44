"""The same output under any hash seed, working directory, locale and time zone."""

from __future__ import annotations

import getpass
import hashlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT
from stagewire_generator import TARGETS, check, render

COMMAND = "from stagewire_cli.main import run; run()"
EVERYTHING = [word for target in TARGETS for word in ("--target", target)]
HERE = Path(__file__).parent
GOOD = ("good_spec", "good_commands", "good_packets")
RUNS = {
    "plain": {"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "TZ": "UTC"},
    "other seed": {"PYTHONHASHSEED": "4711", "LC_ALL": "C", "TZ": "Asia/Tokyo"},
    "with a blank": {"PYTHONHASHSEED": "1", "LC_ALL": "C.UTF-8", "TZ": "America/Caracas"},
    "deep": {"PYTHONHASHSEED": "99", "LC_ALL": "C", "TZ": "Pacific/Kiritimati", "PYTHONUTF8": "0"},
}
FOLDERS = {"plain": "a", "other seed": "b", "with a blank": "c d/é", "deep": "e/f/g/h"}
Trees = dict[str, dict[str, bytes]]


def tree(out: Path) -> dict[str, bytes]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file()
    }


def in_process(name: str) -> dict[str, bytes]:
    """Return the output of all targets for the good specs or the registry, rendered in this process."""
    specs = [ROOT / "spec"] if name == "registry" else [HERE / good for good in GOOD]
    protocols = [protocol for spec in specs for protocol in check(spec)]
    return {path: text.encode() for path, text in render(protocols, list(TARGETS)).items()}


@pytest.fixture(scope="module", params=["good", pytest.param("registry", marks=pytest.mark.matrix)])
def plain(request: pytest.FixtureRequest) -> dict[str, bytes]:
    """The expected output of a run."""
    return in_process(request.param)


@pytest.fixture(scope="module", params=["good", pytest.param("registry", marks=pytest.mark.matrix)])
def trees(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Trees:
    """The output of four runs: two read the original spec, and two read a copy by a relative path."""
    base = tmp_path_factory.mktemp("runs")
    spec = ROOT / "spec"
    if request.param == "good":
        spec = base / "good"
        for name in GOOD:
            shutil.copytree(HERE / name, spec, dirs_exist_ok=True)
    path = [str(Path(p).resolve()) for p in sys.path if p]
    running = {}
    for name, environment in RUNS.items():
        folder = base / FOLDERS[name]
        folder.mkdir(parents=True)
        given = str(spec)
        if name in ("with a blank", "deep"):
            shutil.copytree(spec, folder / "spec")
            given = "spec" if name == "deep" else "./spec"
        running[name] = subprocess.Popen(
            [
                sys.executable,
                "-c",
                COMMAND,
                "generate",
                "--spec",
                given,
                *EVERYTHING,
                "--out",
                "out",
            ],
            cwd=folder,
            env={**os.environ, **environment, "PYTHONPATH": os.pathsep.join(path)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
    found = {}
    for name, process in running.items():
        said, _ = process.communicate(timeout=60)
        assert process.returncode == 0, said.decode("utf-8", "replace")
        found[name] = tree(base / FOLDERS[name] / "out")
    # Rendering some targets does not produce a manifest; writing them updates the one in the folder.
    manifest = {"manifest.json": found["plain"]["manifest.json"]}
    found["expected"] = in_process(request.param) | manifest
    return found


@pytest.mark.parametrize("run", RUNS)
def test_every_run_writes_the_same_tree(trees: Trees, run: str) -> None:
    assert set(trees[run]) == set(trees["expected"])
    for path, data in trees[run].items():
        assert data == trees["expected"][path], path


def test_output_contains_nothing_about_the_machine(plain: dict[str, bytes]) -> None:
    words = {str(ROOT), str(Path.home()), os.getcwd(), "/tmp/", "site-packages", "tmp_path"}
    words |= {socket.gethostname(), getpass.getuser()} - {"root", "localhost", "runner"}
    for path, data in plain.items():
        text = data.decode("utf-8")
        for word in words:
            if len(word) > 2:
                assert not re.search(rf"(?<!\w){re.escape(word)}(?!\w)", text), f"{path}: {word}"


def test_output_contains_no_dates(plain: dict[str, bytes]) -> None:
    """Dates of the document are allowed, because they are written in words."""
    for path, data in plain.items():
        found = re.findall(rb"\b(?:19|20)\d\d-[01]?\d-[0-3]?\d\b|\b\d\d:\d\d:\d\d\b", data)
        assert found == [], path


def test_output_is_plain_text(plain: dict[str, bytes]) -> None:
    for path, data in plain.items():
        text = data.decode("utf-8")
        assert "\r" not in text, path
        assert "\t" not in text, path
        assert not text or text.endswith("\n"), path
        assert not re.search(r"[ ]+$", text, re.MULTILINE), path


def test_the_manifest_has_the_digest_of_every_file() -> None:
    files = {path: text.encode() for path, text in render(check(HERE / "good_spec")).items()}
    listed = json.loads(files.pop("manifest.json"))["files"]
    assert listed == {path: hashlib.sha256(data).hexdigest() for path, data in files.items()}


def test_packages_contain_the_same_json(plain: dict[str, bytes]) -> None:
    for path, data in plain.items():
        for kind in ("registry", "vectors"):
            if re.fullmatch(rf"python/\w+/{kind}\.json", path):
                name = json.loads(data)["protocol"]
                assert data == plain[f"{kind}/{name}.json"]

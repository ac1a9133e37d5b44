"""A third party's protocol, generated as a project, installed by pip and found by an unchanged stagewire.

It has a third framing, so only the generated code can encode it.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import SMALL_SPECS

SPEC = SMALL_SPECS / "good_packets"
COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]
TURN = "AA 55 06 03 13 70 A0 FE 01 85 AB 0D"


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated project, as the folder that pip installs."""
    out = tmp_path_factory.mktemp("mine") / "generated"
    words = ["generate", "--spec-dir", str(SPEC), "--package", "acme_carousel", "--out", str(out)]
    done = subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "python"


@pytest.fixture(scope="module")
def installed(project: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which pip installed the project, without a network."""
    folder = tmp_path_factory.mktemp("site")
    words = ["install", "--quiet", "--no-build-isolation", "--no-deps", "--no-index"]
    words += ["--disable-pip-version-check", "--target", str(folder), str(project)]
    done = subprocess.run(
        [sys.executable, "-m", "pip", *words],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


def stagewire(installed: Path, *words: str, input: str = "") -> str:
    """Run the command with the package installed; return its output."""
    done = subprocess.run(
        [*COMMAND, *words],
        capture_output=True,
        encoding="utf-8",
        env={**os.environ, "PYTHONPATH": str(installed), "PYTHONUTF8": "1", "COLUMNS": "100"},
        input=input,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_pip_installs_only_the_package(installed: Path) -> None:
    package = installed / "acme_carousel"
    files = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert {
        "__init__.py",
        "py.typed",
        "registry.json",
        "vectors.json",
        "messages/table.py",
    } <= files
    [info] = installed.glob("*.dist-info")
    assert info.name == "acme_carousel-1.2.0.dist-info"
    left = {path.name for path in installed.iterdir()} - {package.name, info.name}
    assert left == set(), "other files were installed"


def test_pip_does_not_change_the_generated_project(project: Path, installed: Path) -> None:
    words = ("generate", "--spec-dir", str(SPEC), "--package", "acme_carousel", "--check")
    assert "files, up to date" in stagewire(installed, *words, "--out", str(project.parent))


def test_show_describes_a_message(installed: Path) -> None:
    said = stagewire(installed, "show", "TABLE_TURN")
    assert said.startswith("message TABLE_TURN (carousel)")
    assert "angle" in said


def test_encode_writes_a_packet(installed: Path) -> None:
    words = ("TABLE_TURN", "--form", "data", "--address", "3", "angle=-90000", "way=FORWARD")
    assert stagewire(installed, "encode", *words).strip() == TURN


def test_decode_reads_a_packet(installed: Path) -> None:
    said = json.loads(stagewire(installed, "decode", TURN, "--protocol", "carousel", "--json"))
    assert said["message"] == "TABLE_TURN"
    assert said["address"] == 3
    assert said["fields"] == {"angle": -90000, "way": 1}


def test_the_testee_encodes_and_decodes(installed: Path) -> None:
    requests = [
        {"id": 1, "op": "hello"},
        {"id": 2, "op": "decode", "protocol": "carousel", "hex": TURN.replace(" ", "")},
        {"id": 3, "op": "encode", "protocol": "carousel", "message": "TABLE_TURN", "form": "data",
         "address": 3, "fields": {"angle": -90000, "way": 1}},
    ]  # fmt: skip
    lines = "".join(f"{json.dumps(request)}\n" for request in requests)
    hello, decoded, encoded = map(
        json.loads, stagewire(installed, "testee", input=lines).splitlines()
    )
    assert hello["protocols"] == ["asi_ms2000", "carousel", "thorlabs_apt"]
    assert (decoded["ok"], decoded["message"], decoded["address"]) == (True, "TABLE_TURN", 3)
    assert (encoded["ok"], encoded["hex"]) == (True, TURN.replace(" ", "").lower())


def test_the_examples_pass(installed: Path) -> None:
    said = stagewire(installed, "conformance", "examples", "--protocol", "carousel")
    assert " 0 failed, " in said


def test_the_commands_of_the_readme_work(project: Path, installed: Path) -> None:
    """The commands to try run in the order of the README and print what it says."""
    text = (project / "README.md").read_text(encoding="utf-8")
    _, tried, _ = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    show, encode, piped = (line.split() for line in tried.splitlines())
    assert "WHEEL_SELECT" in stagewire(installed, *show[1:])
    packet = stagewire(installed, *encode[1:])
    at = piped.index("|")
    assert piped[:at] == encode
    assert "WHEEL_SELECT" in stagewire(installed, *piped[at + 2 :], input=packet)


@pytest.fixture(scope="module")
def testee_in_c(project: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The testee in C, compiled with the command of the README."""
    words = ["generate", "--spec-dir", str(SPEC), "--package", "acme_carousel"]
    words += ["--target", "c-tests", "--out", str(project.parent)]
    subprocess.run([*COMMAND, *words], capture_output=True, check=True)
    text = (project / "README.md").read_text(encoding="utf-8")
    *_, command = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    made = tmp_path_factory.mktemp("c") / "testee"
    assert "-o testee " in command
    done = subprocess.run(
        ["bash", "-c", command.replace("-o testee ", f"-Wall -Wextra -Werror -o {made} ")],
        cwd=project.parent / "c",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return made


def test_the_testee_in_c_answers_as_the_one_in_python(installed: Path, testee_in_c: Path) -> None:
    """The answers to all cases of the protocol are those in the vectors."""
    vectors = json.loads((installed / "acme_carousel" / "vectors.json").read_text("utf-8"))
    requests = [
        {"id": number, "protocol": "carousel", **case["request"]}
        for number, case in enumerate(vectors["cases"])
    ]
    lines = "".join(f"{json.dumps(request)}\n" for request in requests)
    done = subprocess.run([testee_in_c], input=lines, capture_output=True, text=True, check=True)
    in_python = stagewire(installed, "testee", input=lines)
    assert len(requests) > 500
    for case, *said in zip(
        vectors["cases"], done.stdout.splitlines(), in_python.splitlines(), strict=True
    ):
        for line in said:
            answer = json.loads(line)
            answer.pop("detail", None)
            del answer["id"]
            assert answer == case["answer"], case["id"]


@pytest.mark.parametrize(
    "compiler",
    [("gcc", "-x", "c", "-std=c99", "-Wstrict-prototypes"), ("g++", "-x", "c++", "-std=c++17")],
)
def test_the_c_code_of_the_project_compiles(
    project: Path, compiler: tuple[str, ...], tmp_path: Path
) -> None:
    c = project.parent / "c"
    user = tmp_path / "user.c"
    user.write_text(
        '#include "acme_carousel/acme_carousel.h"\n#include "acme_carousel/quantities.h"\n'
    )
    words = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow"]
    words += ["-Wcast-qual", "-Wundef", "-Werror", "-ffreestanding", "-fsyntax-only", f"-I{c}"]
    sources = [user, c / "acme_carousel" / "acme_carousel.c"]
    done = subprocess.run(
        [*compiler, *words, *sources], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_the_protocols_of_stagewire_still_work(installed: Path) -> None:
    said = stagewire(installed, "decode", "53 04 06 00 D0 01 01 00 40 0D 03 00")
    assert "MOT_MOVE_ABSOLUTE" in said

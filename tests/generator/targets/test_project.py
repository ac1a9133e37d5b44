"""``--package``: the project around a package, its name, and that no text gets out of its quotes."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stagewire
from checkout import ROOT
from stagewire_cli.main import main
from stagewire_generator import check, render
from stagewire_generator.model import Protocol
from stagewire_generator.naming import why_no_project
from stagewire_generator.targets import project as target
from stagewire_generator.targets.project.view import markdown, requirement, toml
from stagewire_generator.targets.templates import Templates

PROJECT = {"python/README.md", "python/pyproject.toml"}
NAME = "acme_carousel"
TEMPLATES = Templates()
SPEC = ROOT / "spec"


@pytest.fixture(scope="module")
def project(packets: Protocol) -> dict[str, str]:
    return render([packets], package=NAME)


def test_without_a_package_nothing_is_added(
    packets: Protocol, packet_files: dict[str, str]
) -> None:
    assert not PROJECT & packet_files.keys()
    assert packet_files == render([packets], package="")


def test_the_package_has_another_name(
    project: dict[str, str], packet_files: dict[str, str]
) -> None:
    """And nothing else changes: not the registry, nor the vectors; names in C begin with another prefix."""
    renamed = {path.replace("stagewire_carousel", NAME) for path in packet_files}
    assert project.keys() == renamed | PROJECT
    for path, text in packet_files.items():
        if path != "manifest.json" and not path.startswith("c/"):
            new = path.replace("stagewire_carousel", NAME)
            assert sorted(project[new].replace(NAME, "stagewire_carousel").split()) == sorted(
                text.split()
            ), path
    listed = json.loads(project["manifest.json"])["files"]
    assert listed.keys() == project.keys() - {"manifest.json"}


def test_what_pip_reads(project: dict[str, str]) -> None:
    data = tomllib.loads(project["python/pyproject.toml"])
    assert data["build-system"]["build-backend"] == "hatchling.build"
    assert data["project"] == {
        "name": "acme-carousel",
        "version": "1.2.0",
        "description": "Packets of the carousel: messages, made by stagewire",
        "readme": "README.md",
        "requires-python": ">=3.11",
        "dependencies": [requirement(stagewire.__version__)],
        "classifiers": ["Programming Language :: Python :: 3", "Typing :: Typed"],
        "entry-points": {"stagewire.protocols": {"carousel": "acme_carousel:PROTOCOL"}},
    }
    assert data["tool"] == {"hatch": {"build": {"ignore-vcs": True, "only-include": [NAME]}}}


@pytest.mark.parametrize(
    ("version", "wanted"),
    [
        ("0.1.0", "stagewire>=0.1,<0.2"),
        ("0.12.3.dev1", "stagewire>=0.12,<0.13"),
        ("1.0.0", "stagewire>=1.0,<2"),
        ("2.7rc1", "stagewire>=2.7,<3"),
    ],
)
def test_the_runtime_that_it_needs(version: str, wanted: str) -> None:
    assert requirement(version) == wanted


def test_no_version() -> None:
    with pytest.raises(ValueError, match="unknown is no version"):
        requirement("unknown")


ANYTHING = st.text(st.characters(exclude_categories=["Cs"]))


@given(ANYTHING)
def test_no_text_gets_out_of_toml(text: str) -> None:
    assert tomllib.loads(f"a = {toml(text)}\nb = 1\n") == {"a": text, "b": 1}
    assert len(toml(text).splitlines()) == 1


@settings(deadline=None)
@given(ANYTHING)
def test_no_text_becomes_a_project(packets: Protocol, text: str) -> None:
    hostile = replace(packets, title=text, summary=text, package=NAME)
    data = tomllib.loads(target.render(hostile, TEMPLATES)["python/pyproject.toml"])
    assert data.keys() == {"build-system", "project", "tool"}
    assert data["project"]["description"].startswith(" ".join(text.split()))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("MS-2000: a stage, 5 µm", "MS-2000: a stage, 5 µm"),
        ("<img src=x> & [a](b) `c` *d* _e_", r"\<img src=x\> \& \[a\](b) \`c\` \*d\* \_e\_"),
        ("# a", r"\# a"),
        ("- a", r"\- a"),
        ("1. a", r"1\. a"),
        ("12) a", r"12\) a"),
        ("12 a", "12 a"),
        ("a\\b", r"a\\b"),
        ("", ""),
    ],
)
def test_markdown(text: str, wanted: str) -> None:
    assert markdown(text) == wanted


def test_what_a_reader_tries(project: dict[str, str]) -> None:
    """A message with few fields; that the commands work is tried where the package is installed."""
    text = project["python/README.md"]
    assert text.count("```sh") == 3
    assert "stagewire show WHEEL_SELECT --protocol carousel\n" in text
    assert "stagewire encode WHEEL_SELECT --address 1 filter=EMPTY --protocol carousel\n" in text


@pytest.mark.parametrize(
    ("name", "encode", "decode"),
    [
        ("thorlabs_apt", "HW_START_UPDATEMSGS update_rate=1", ""),
        ("asi_ms2000", "WRITE_MOTOR_POSITION --axis X position=1", " --direction command"),
    ],
)
def test_what_a_reader_of_other_framings_tries(
    capsys: pytest.CaptureFixture[str], name: str, encode: str, decode: str
) -> None:
    """Of protocols that are installed, so that it can be tried here."""
    [protocol] = check(SPEC / name)
    text = render([protocol], ["python"], package=NAME)["python/README.md"]
    encode = f"encode {encode} --protocol {name}"
    assert f"\nstagewire {encode}\n" in text
    assert f"\nstagewire {encode} | stagewire decode - --protocol {name}{decode}\n" in text
    assert main(encode.split()) == 0
    frame = capsys.readouterr().out.split()
    assert main(["decode", *frame, "--protocol", name, *decode.split()]) == 0
    assert encode.split()[1] in capsys.readouterr().out


def test_a_protocol_without_messages_has_nothing_to_try(packets: Protocol) -> None:
    empty = replace(packets, messages=())
    assert "## Try" not in render([empty], ["python"], package=NAME)["python/README.md"]


# The command


def generate(*words: object) -> int:
    return main(["generate", *map(str, words)])


def test_twice_the_same(good_packets: Path, tmp_path: Path) -> None:
    words = ("--spec-dir", good_packets, "--package", NAME, "--out")
    assert generate(*words, tmp_path / "a") == generate(*words, tmp_path / "b") == 0
    files = [p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file()]
    assert {Path(path) for path in PROJECT} < set(files)
    for path in files:
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes()


def test_drift(good_packets: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--spec-dir", good_packets, "--package", NAME, "--out", tmp_path / "out")
    assert generate(*words) == 0
    assert generate(*words, "--check") == 0
    readme = tmp_path / "out" / "python" / "README.md"
    readme.write_text("mine\n", encoding="utf-8")
    capsys.readouterr()
    assert generate(*words, "--check") == 1
    assert "changed: python/README.md" in capsys.readouterr().out
    assert generate("--spec-dir", good_packets, "--out", tmp_path / "out", "--check") == 1


@pytest.mark.parametrize(("target", "listed"), [("python", True), ("registry", False)])
def test_the_project_belongs_to_the_package(
    good_packets: Path, tmp_path: Path, target: str, listed: bool
) -> None:
    out = tmp_path / "out"
    words = ("--spec-dir", good_packets, "--package", NAME, "--target", target, "--out", out)
    assert generate(*words) == 0
    assert (out / "python" / "pyproject.toml").exists() is listed


def test_several_protocols(
    good_packets: Path, good_spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    folders = ("--spec-dir", good_packets, "--spec-dir", good_spec)
    assert generate(*folders, "--package", NAME, "--out", out) == 2
    assert capsys.readouterr().err == (
        "stagewire: --package takes one protocol, and there are 2: carousel, tiny; give the folder of "
        "one of them\n"
    )
    assert not out.exists()
    assert generate(*folders, "--out", out) == 0  # without it several are welcome
    assert {path.name for path in (out / "c").iterdir()} == {"stagewire_carousel", "stagewire_tiny"}


BAD = {
    "": "lower-case letters",
    "Acme": "lower-case letters",
    "acme-table": "lower-case letters",
    "acme__table": "lower-case letters",
    "_acme": "lower-case letters",
    "1acme": "lower-case letters",
    "acme\n": "lower-case letters",
    "äcme": "lower-case letters",
    "../acme": "lower-case letters",
    "a" * 41: "at most 40",
    "stagewire": "begin with stagewire",
    "stagewire_apt": "begin with stagewire",
    "stagewire_mine": "begin with stagewire",
    "json": "already used by",
    "rich": "already used by",
    "nul": "already used by",
    "lambda": "already used by",
}


@pytest.mark.parametrize("name", BAD)
def test_names_that_no_package_can_have(
    good_packets: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    out = tmp_path / "out"
    assert generate("--spec-dir", good_packets, "--package", name, "--out", out) == 2
    said = capsys.readouterr().err
    assert said.startswith("stagewire: --package ")
    assert BAD[name] in said
    assert not out.exists()


def test_a_name_that_is_too_long_for_names_in_c(
    good_packets: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The names of a spec were checked behind the name that the spec has; here they have another."""
    out, name = tmp_path / "out", "a" * 40
    assert generate("--spec-dir", good_packets, "--package", name, "--out", out) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"stagewire: --package {name}: TABLE_")
    assert ": the first 63 characters of " in said
    assert said.endswith(" are the same in C\n")
    assert not out.exists()


@pytest.mark.parametrize("name", ["acme", "acme2_table", "a" * 40])
def test_names_that_a_package_can_have(name: str) -> None:
    assert why_no_project(name) == ""

"""The command prints texts of a spec literally: they cannot control the terminal or act as markup."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from outputs import write_tree
from payloads import HIDDEN
from text_places import Files, Place, all_changed, changed, places, write

from stagewire_cli.main import main
from stagewire_generator import TARGETS, check, render

MARKUP = "[red]x[/red] [/] [link=file:///etc/passwd]y[/link] :boom: [bold"
DIST_INFO = """\
[stagewire.protocols]
tiny = stagewire_tiny:PROTOCOL
turtle = stagewire_turtle:PROTOCOL
"""


@pytest.fixture(scope="module")
def installed(files: Files, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages with markup in all texts, which look installed."""
    base = tmp_path_factory.mktemp("installed")
    texts = []
    for place in places(files):
        if place.unread:
            # titles of sections must differ
            number = f" {place.path[-1]}" if "sections" in place.path else ""
            texts.append((place, MARKUP[: place.longest - len(number)] + number))
    files = all_changed(files, texts)
    out = write_tree(render(check(write(files, base / "spec")), TARGETS), base / "out")
    folder = out / "python"
    (folder / "tiny-1.dist-info").mkdir()
    (folder / "tiny-1.dist-info" / "METADATA").write_text("Name: tiny\nVersion: 1\n")
    (folder / "tiny-1.dist-info" / "entry_points.txt").write_text(DIST_INFO)
    return folder


@pytest.fixture
def stagewire(
    installed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Callable[..., str]]:
    """Run the command and return its output, after checking that it cannot control a terminal."""
    monkeypatch.syspath_prepend(str(installed))
    before = set(sys.modules)

    def run(*arguments: str, protocol: str = "tiny") -> str:
        main([*arguments, "--protocol", protocol])
        captured = capsys.readouterr()
        said = captured.out + captured.err
        assert all(line.isprintable() for line in said.split("\n")), said
        return said

    yield run
    for name in set(sys.modules) - before:
        if name.split(".")[0] in ("stagewire_tiny", "stagewire_turtle"):
            del sys.modules[name]


@pytest.mark.parametrize(
    "name",
    [
        "POS_MOVE", "POS_VELPARAMS", "channel", "state_bits", "distance", "pressure", "TP1", "Slide", "TPx",
        "plain", "tiny-move-length", "POS_MOVED", "SHUTTER",
    ],
)  # fmt: skip
def test_show_prints_texts_literally(stagewire: Callable[..., str], name: str) -> None:
    said = stagewire("show", name)
    if name not in ("POS_VELPARAMS", "TPx"):  # these have no text
        assert MARKUP in said
    for line in stagewire("show", "--json", name).splitlines():
        assert line.isprintable()


@pytest.mark.parametrize(
    "name",
    [
        "WAKE",
        "GO_TO",
        "WHERE",
        "SPIN",
        "axis",
        "eyes",
        "distance",
        "Turtle",
        "reptile",
        "turtle-tail",
    ],
)
def test_show_prints_texts_of_commands_literally(stagewire: Callable[..., str], name: str) -> None:
    assert MARKUP in stagewire("show", name, protocol="turtle")
    for line in stagewire("show", "--json", name, protocol="turtle").splitlines():
        assert line.isprintable()


@pytest.mark.parametrize(("protocol", "title"), [("tiny", "echo"), ("turtle", "wake")])
def test_conformance_examples_prints_texts_literally(
    stagewire: Callable[..., str], protocol: str, title: str
) -> None:
    """One example has escape sequences in its fields, which a controller may send."""
    said = stagewire("conformance", "examples", protocol=protocol)
    assert title in said
    for line in stagewire("conformance", "examples", "--json", protocol=protocol).splitlines():
        if line.startswith("{"):
            json.loads(line)


def test_decode_cannot_control_the_terminal(stagewire: Callable[..., str]) -> None:
    raw = "22 01 10 00 D0 01 61 1B 5B 33 31 6D 9B 0A 00 00 00 00 00 00 00 00"
    said = stagewire("decode", raw)
    assert "POS_ECHO" in said


def test_decode_of_commands_cannot_control_the_terminal(stagewire: Callable[..., str]) -> None:
    """Both the text in a command and invalid bytes may contain anything."""
    raw = "01 4E 04 1B 5B 9B 00 2E 1B 5D 30 2E"
    assert "NAME" in stagewire("decode", raw, protocol="turtle")


@pytest.mark.parametrize("name", HIDDEN)
def test_diagnostics_show_refused_payloads_harmlessly(
    files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The payload is a text, a key and a file name."""
    text = HIDDEN[name]
    stage = ("stages", "Slide")
    for path, is_key in (
        ((*stage, "title"), False),
        ((*stage, "controllers"), True),
        (stage, True),
    ):
        place = Place("tiny/stages.yaml", path, is_key, frozenset(), True, 200)
        files = changed(files, place, text)
    spec = write(files, tmp_path)
    if "/" not in text and "\0" not in text:
        (spec / "tiny" / "messages" / f"{text}.yaml").write_text("a: 010\n")
    assert main(["check", str(spec)]) == 1
    captured = capsys.readouterr()
    assert captured.out.count(": SW007 ") + captured.out.count(": SW010 ") >= 3
    assert all(line.isprintable() for line in (captured.out + captured.err).split("\n"))


def test_generate_check_shows_hostile_file_names_harmlessly(
    files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = write(files, tmp_path / "spec")
    out = tmp_path / "out"
    assert main(["generate", "--spec", str(spec), "--out", str(out)]) == 0
    (out / "x\x1b[31m\n\u202e.py").write_text("x")
    (out / "python" / "stagewire_tiny" / "registry.json").write_text("x\x1b[31m\u202e\x9b\r\n")
    capsys.readouterr()
    assert main(["generate", "--spec", str(spec), "--out", str(out), "--check"]) == 1
    captured = capsys.readouterr()
    assert "stagewire_tiny/registry.json" in captured.out
    assert all(line.isprintable() for line in (captured.out + captured.err).split("\n"))

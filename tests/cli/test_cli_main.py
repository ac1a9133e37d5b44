"""The command as a whole: help with examples, exit codes, and errors without a traceback."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import pytest
import typer

import stagewire as library
from checkout import ROOT
from parts import every_nth
from stagewire.errors import StagewireError
from stagewire_cli import commands, show
from stagewire_cli import main as command
from stagewire_cli.commands import NAMES

if TYPE_CHECKING:
    from conftest import Stagewire

COMMANDS = [
    *NAMES,
    *(f"conformance {name}" for name in ("examples", "codec", "device", "pics", "rules")),
]
RUN = "from stagewire_cli.main import run; run()"


def process(arguments: Sequence[str], **options: object) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(  # type: ignore[call-overload, no-any-return]
        [sys.executable, "-c", RUN, *arguments], capture_output=True, timeout=60, **options
    )


@pytest.mark.parametrize("name", [*COMMANDS, ""])
def test_help_has_an_example(stagewire: Stagewire, name: str) -> None:
    result = stagewire(*name.split(), "--help")
    assert result.code == 0
    assert "Example" in result.out
    assert any(before + "stagewire " in result.out for before in ("    ", "| ", "Example: "))


def test_the_help_lists_every_command_once_and_fits_a_small_terminal(stagewire: Stagewire) -> None:
    lines = stagewire("--help").out.splitlines()
    assert len(lines) <= 23  # the prompt needs the last of 24
    assert max(map(len, lines)) <= 80
    rows = [line[2:].split("  ")[0] for line in lines if line.startswith("  ")]
    listed = [name for row in rows for name in row.split(", ")]
    assert sorted(listed) == sorted(set(listed)) == sorted(commands._PLACES)
    assert not [line for line in lines if line.endswith("...") and "COMMAND" not in line]


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"], ["--version"]])
def test_the_help_imports_no_sub_command(arguments: list[str]) -> None:
    assert not typer.main.get_command(command.command(arguments)).commands


def test_version_is_printed(stagewire: Stagewire) -> None:
    assert stagewire("--version").out == f"stagewire {library.__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [["fly"], ["--fly"], ["decode", "--fly", "00"], ["conformance", "fly"], ["testee", "x"]],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str]) -> None:
    result = stagewire(*arguments)
    assert result.code == 2
    assert result.err


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (StagewireError("a sentence"), 1, "stagewire: a sentence\n"),
        (FileNotFoundError(2, "No such file", "x.txt"), 2, "stagewire: x.txt: No such file\n"),
        (BrokenPipeError(32, "Broken pipe"), 1, ""),
        (KeyboardInterrupt(), 130, ""),
    ],
    ids=["ours", "file", "pipe", "interrupt"],
)
def test_errors_are_printed_as_sentences(
    stagewire: Stagewire,
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    said: str,
) -> None:
    def fail(_: object) -> None:
        raise error

    monkeypatch.setattr(show, "registry_of", fail)
    monkeypatch.setattr(command, "_drop_output", lambda: None)
    result = stagewire("show", "x")
    assert result.code == code
    assert said in result.err


def test_a_missing_generator_extra_is_explained(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith("stagewire_generator")]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("yaml", "jinja2", "jsonschema", "jsonschema_rs"):
        monkeypatch.setitem(sys.modules, name, None)
    for words in (["check"], ["generate"], ["diff", "spec", "spec"]):
        result = stagewire(*words)
        assert result.code == 2
        assert "pip install 'stagewire[generator]'" in result.err


def test_only_the_module_of_the_command_is_imported() -> None:
    code = (
        "import sys; from stagewire_cli.main import command; command(sys.argv[1:]); "
        "print(*(name for name in sys.modules if name.startswith('stagewire')))"
    )
    run = [sys.executable, "-c", code, "generate", "--spec", "show"]
    loaded = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    assert "stagewire_cli.generate" in loaded
    assert not {"stagewire_cli.show", "stagewire_conformance", "stagewire_apt"} & set(loaded)


def test_testee_answers_in_a_process() -> None:
    lines = b'{"id":1,"op":"hello"}\nnonsense\n{"id":"end","op":"hello"}'
    done = process(["testee"], input=lines)
    assert done.returncode == 0
    assert done.stderr == b""
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert [(answer["id"], answer["ok"]) for answer in answers] == [
        (1, True),
        (None, False),
        ("end", True),
    ]


def test_a_closed_pipe_ends_the_command_quietly() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb") as closed:
        done = subprocess.run(
            [sys.executable, "-c", RUN, "decode", "-"],
            input=bytes.fromhex("430401005001") * 20_000,
            stdout=closed,
            stderr=subprocess.PIPE,
            timeout=60,
        )
    assert done.returncode == 1
    assert b"Traceback" not in done.stderr
    assert b"Exception ignored" not in done.stderr


def test_output_works_in_any_encoding() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = process(["show", "MOT_MOVE_ABSOLUTE"], env=environment)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(os.name != "posix", reason="closes descriptors before exec")
@pytest.mark.parametrize(
    ("words", "descriptor"),
    every_nth(
        product(
            (["decode", "-"], ["testee"], ["show", "MOT_MOVE_HOME"], ["decode", "zz"]), (0, 1, 2)
        ),
        4,
    ),
)
def test_a_closed_standard_stream_is_tolerated(words: list[str], descriptor: int) -> None:
    shell = f'exec "$@" {descriptor}{"<" if descriptor == 0 else ">"}&-'
    done = subprocess.run(
        ["sh", "-c", shell, "sh", sys.executable, "-c", RUN, *words],
        input=b"",
        capture_output=True,
        timeout=60,
    )
    assert done.returncode == (2 if words == ["decode", "zz"] else 0)
    assert b"Traceback" not in done.stderr
    if descriptor == 2:
        assert b"stagewire: " not in done.stdout


@pytest.mark.parametrize("words", [["show"], ["encode"], ["show", "x", "--protocol"]])
def test_arguments_cannot_control_the_terminal(stagewire: Stagewire, words: list[str]) -> None:
    result = stagewire(*words, "\x1b[2J")
    assert result.code == 2
    assert "\x1b" not in result.err
    assert "\\x1b[2" in result.err


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_a_sub_command_does_not_depend_on_imports(name: str) -> None:
    """Only the called sub-command is imported, which must not change its help."""

    def said(arguments: Sequence[str] | None) -> str:
        group = typer.main.get_command(command.command(arguments))
        part = group.commands[name]
        return str(part.get_help(part.context_class(part, info_name=name)))

    assert said([name]) == said(None)


_UNQUOTED = re.compile(r"^[^#\n\"']*(?:\"[^\"\n]*\"[^\"\n]*)*(?<![\"'\w])\w+://[^\s\"']*[?*]", re.M)


def test_urls_in_examples_are_quoted_for_zsh(stagewire: Stagewire) -> None:
    """Without quotes zsh takes the question mark for a pattern of file names."""
    assert _UNQUOTED.search("stagewire home virtual://TDC001?stage=Z8")
    assert not _UNQUOTED.search('stagewire home "virtual://TDC001?stage=Z8" --yes')
    for name in COMMANDS:
        assert not _UNQUOTED.search(stagewire(*name.split(), "--help").out), name
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for page in pages:
        for block in re.findall(r"```(?:sh|console)\n(.*?)```", page.read_text("utf-8"), re.S):
            assert not _UNQUOTED.search(block), page

"""Quick syntax checks of the blocks on walkthrough pages. The walkthroughs themselves take minutes."""

from __future__ import annotations

import ast
import json
import shlex

import pytest
import typer
import yaml

import plain_yaml
from checkout import ROOT
from markdown_blocks import Block, blocks
from stagewire_cli.main import command

DOCS = ROOT / "docs"
PAGES = (
    "how-to/add-a-framing.md",
    "how-to/correct-a-fact.md",
    "how-to/overlays.md#Add a unit and its stage",
    "tutorials/new-message.md",
    "tutorials/your-own-protocol.md",
)
COMMANDS = set(typer.main.get_command(command()).commands)


def read(block: Block) -> None:
    """Parse a block as its language; raise an error if it is invalid."""
    if block.language == "python":
        ast.parse(block.text)
    elif block.language == "yaml":
        assert isinstance(plain_yaml.load(block.text), dict)
    elif block.language == "json":
        json.loads(block.text)
    elif block.language == "console":
        written = block.text.replace("\\\n", " ").splitlines()
        lines = [line[2:] for line in written if line.startswith("$ ")]
        assert lines
        for line in lines:
            words = shlex.split(line, comments=True)
            assert words[0] != "stagewire" or words[1] in COMMANDS, line


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_valid(page: str) -> None:
    document, _, section = page.partition("#")
    found = [block for block in blocks(DOCS / document) if section in ("", block.section)]
    assert {"console", "yaml"} <= {block.language for block in found}
    for block in found:
        read(block)


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("python", "import from"),
        ("yaml", "a: [b"),
        ("yaml", "words"),
        ("json", "{"),
        ("console", "$ stagewire chekc spec"),
        ("console", "$ echo 'x"),
        ("console", "nothing"),
    ],
)
def test_an_invalid_block_is_detected(language: str, text: str) -> None:
    with pytest.raises((SyntaxError, ValueError, AssertionError, yaml.YAMLError)):
        read(Block("", 1, language, text))

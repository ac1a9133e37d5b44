"""Every code block of the documentation is run by a test, or has a reason not to be."""

from __future__ import annotations

import re

import pytest
from block_runners import (
    BY_MACHINE,
    ELSEWHERE,
    LONG,
    NOT_RUN,
    READ_ONLY,
    documents,
    here,
    is_elsewhere,
)
from shell import lines
from test_pages_data import READ_BY

from checkout import ROOT
from markdown_blocks import blocks

WIDTH = 110
"""Maximum number of characters in a line of prose."""

RUN = {"python", "sh"}
"""Languages whose blocks the tests of this folder run."""


@pytest.mark.parametrize("document", documents())
def test_every_block_is_run_by_a_test(document: str) -> None:
    text = (ROOT / document).read_text(encoding="utf-8")
    found = list(blocks(ROOT / document))
    assert text.count("```") == 2 * len(found), "a fence is inside a line, indented or unclosed"
    left = [
        f"line {block.line}: no test runs this block of {block.language or 'no language'!r}"
        for block in found
        if block.language not in RUN
        and not is_elsewhere(document, block)
        and (document, block.first) not in READ_ONLY
        and (document, block.first) not in READ_BY
    ]
    assert left == []


@pytest.mark.parametrize(("document", "test"), list(ELSEWHERE.items()))
def test_the_tests_in_other_folders_exist(document: str, test: str) -> None:
    page, _, section = document.partition("#")
    assert page in documents()
    sections = {block.section for block in blocks(ROOT / page)}
    assert section in sections if section else sections
    folder = (ROOT / test).parent
    assert (ROOT / test).is_file()
    name = document.rpartition("/")[2]
    assert any(name in path.read_text(encoding="utf-8") for path in folder.glob("*.py"))


def test_every_row_of_the_tables_has_a_block() -> None:
    commands = {command for _, block in here("sh") for command, _ in lines(block.text)}
    assert (NOT_RUN.keys() | LONG.keys() | BY_MACHINE.keys()) - commands == set()
    there = {
        (document, block.first) for document in documents() for block in blocks(ROOT / document)
    }
    assert (READ_ONLY.keys() | READ_BY.keys()) - there == set()
    assert READ_ONLY.keys() & READ_BY.keys() == set()


@pytest.mark.parametrize("document", documents())
def test_lines_of_prose_have_at_most_110_characters(document: str) -> None:
    """Tables and blocks may be wider."""
    text = re.sub(r"^ *```.*?^ *```$", "", (ROOT / document).read_text("utf-8"), flags=re.M | re.S)
    long = [line for line in text.splitlines() if len(line) > WIDTH and line[:1] not in "|<"]
    assert [line for line in long if " " in line.strip()] == []

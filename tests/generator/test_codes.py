"""The table of diagnostics, and the page that is generated from it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT
from stagewire_generator.codes import CODES, GROUPS, Code
from stagewire_generator.codes_page import anchor, page

PAGE = ROOT / "docs" / "diagnostics.md"


@pytest.mark.parametrize("name", CODES)
def test_a_code_is_explained(name: str) -> None:
    """Title and hint are printed after other words on a line; a cause is one or more sentences."""
    code = CODES[name]
    assert re.fullmatch(r"SW\d{3}", name)
    for text in (code.title, code.hint):
        assert not text.endswith(".")
        assert "\n" not in text
        assert not re.match(r"[A-Z][a-z]", text)
    assert re.fullmatch(r"[A-Z`].*\.", code.cause)
    assert len(code.cause) > 40
    assert code.title not in code.cause


@pytest.mark.parametrize("missing", ["title", "cause", "hint"])
def test_a_code_requires_an_explanation(missing: str) -> None:
    texts = {"title": "wrong", "cause": "A mistake.", "hint": "mend it"}
    assert Code(**texts).title == "wrong"
    with pytest.raises(ValueError, match=f"without a {missing}"):
        Code(**{**texts, missing: " "})
    del texts[missing]
    with pytest.raises(TypeError):
        Code(**texts)


def test_a_code_belongs_to_one_group() -> None:
    names = [name for group in GROUPS for name in group.codes]
    assert len(names) == len(set(names)) == len(CODES)
    for group in GROUPS:
        assert list(group.codes) == sorted(group.codes)
        assert group.introduction.endswith(".")


def test_the_page_matches_the_table() -> None:
    """To update it, run ``python -m stagewire_generator.codes_page docs/diagnostics.md``."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_a_command_writes_the_page(tmp_path: Path) -> None:
    made = tmp_path / "page.md"
    command = [sys.executable, "-m", "stagewire_generator.codes_page", str(made)]
    subprocess.run(command, check=True)
    assert made.read_bytes() == PAGE.read_bytes()


def test_every_code_has_an_anchor_and_its_texts() -> None:
    parts = re.split(r"^### (SW\d{3})$", page(), flags=re.MULTILINE)
    explained = dict(zip(parts[1::2], parts[2::2], strict=True))
    assert list(explained) == [name for group in GROUPS for name in group.codes]
    for name, code in CODES.items():
        text = " ".join(explained[name].split())
        for wanted in (code.title, code.cause, code.hint):
            assert wanted[1:] in text
        assert anchor(name) == f"docs/diagnostics.md#{name.lower()}"

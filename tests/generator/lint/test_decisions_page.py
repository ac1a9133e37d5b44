"""The page that lists the decisions of all protocols."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from checkout import ROOT
from stagewire_generator.decisions_page import page

PAGE = ROOT / "docs" / "reference" / "decisions.md"


def test_the_page_matches_the_registry() -> None:
    """To update it, run ``python -m stagewire_generator.decisions_page spec docs/reference/decisions.md``."""
    assert PAGE.read_text(encoding="utf-8") == page(ROOT / "spec")


def test_a_page_of_one_decision(good_commands: Path) -> None:
    made = page(good_commands)
    assert "\n## Commands of the turtle\n\n1 decisions on 1 facts.\n\n### longest\n" in made
    assert "\n- `framing/maximum_length`: `255`\n\nReason: The document names no" in made


def test_a_command_writes_the_page(tmp_path: Path, good_commands: Path) -> None:
    made = tmp_path / "page.md"
    command = [sys.executable, "-m", "stagewire_generator.decisions_page"]
    subprocess.run([*command, str(good_commands), str(made)], check=True)
    assert made.read_text(encoding="utf-8") == page(good_commands)

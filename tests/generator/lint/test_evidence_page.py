"""The page that counts the evidence of all protocols and overlays."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from checkout import ROOT
from stagewire_generator.evidence_page import page

PAGE = ROOT / "docs" / "reference" / "evidence.md"


def test_the_page_matches_the_registry() -> None:
    """To update it, run ``python -m stagewire_generator.evidence_page spec docs/reference/evidence.md``."""
    assert PAGE.read_text(encoding="utf-8") == page(ROOT / "spec")


def test_the_page_counts_the_facts_of_an_overlay(overlaid_spec: Path) -> None:
    made = page(overlaid_spec)
    assert "## `tiny`" not in made  # it has no evidence
    assert "## `tiny/second`" in made
    assert "| units | 4 | 0 | 1 | 0 | 0 | 3 |" in made
    assert "Units that rest on the document alone: `TP1`, `TP2`, `TP9`." in made
    assert "- `frames` (hardware frames): someone/tiny/frames.py, commit 0123abc" in made


def test_a_command_writes_the_page(tmp_path: Path, overlaid_spec: Path) -> None:
    made = tmp_path / "page.md"
    command = [sys.executable, "-m", "stagewire_generator.evidence_page"]
    subprocess.run([*command, str(overlaid_spec), str(made)], check=True)
    assert made.read_text(encoding="utf-8") == page(overlaid_spec)

"""The blocks of docs/how-to/build-systems.md, which the tests here run as they stand."""

from __future__ import annotations

import markdown_blocks
from checkout import ROOT


def blocks(language: str | None = None) -> list[str]:
    """Return the blocks of the page that are written in a language, or all."""
    return [
        block.text
        for block in markdown_blocks.blocks(ROOT / "docs" / "how-to" / "build-systems.md", language)
    ]

"""The blocks of docs/how-to/build-systems.md, which these tests run unchanged."""

from __future__ import annotations

import markdown_blocks
from checkout import ROOT


def blocks(language: str | None = None) -> list[str]:
    """Return the blocks of the page in one language, or all."""
    return [
        block.text
        for block in markdown_blocks.blocks(ROOT / "docs" / "how-to" / "build-systems.md", language)
    ]

"""The blocks of docs/build-systems.md, which the tests here run as they stand."""

from __future__ import annotations

import fenced
from fenced import ROOT

__all__ = ["ROOT", "blocks"]


def blocks(language: str | None = None) -> list[str]:
    """Return the blocks of the page that are written in a language, or all."""
    return [block.text for block in fenced.blocks(ROOT / "docs" / "build-systems.md", language)]

"""The blocks of docs/build-systems.md, which the tests here run as they stand."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["ROOT", "blocks"]

ROOT = Path(__file__).parents[2]
_PAGE = (ROOT / "docs" / "build-systems.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Return the blocks of the page that are written in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", _PAGE, re.M | re.S)

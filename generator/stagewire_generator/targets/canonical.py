"""Canonical JSON: the same data gives the same bytes, whoever writes it."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["canonical"]


def canonical(data: Any) -> str:
    """Return ``data`` as JSON with sorted keys, two blanks of indent, and a final newline."""
    return json.dumps(data, ensure_ascii=False, indent=2, sort_keys=True) + "\n"

"""Canonical JSON: the same data gives the same bytes, whoever writes it."""

from __future__ import annotations

import json
import re
from typing import Any

__all__ = ["canonical"]


# What JSON allows as it stands, and could steer a terminal: an example may hold any byte as text.
_HIDDEN = re.compile("[\x7f-\x9f\xad]")


def canonical(data: Any) -> str:
    """Return ``data`` as JSON with sorted keys, two blanks of indent, and a final newline."""
    text = json.dumps(data, ensure_ascii=False, indent=2, sort_keys=True)
    return _HIDDEN.sub(lambda char: f"\\u{ord(char[0]):04x}", text) + "\n"

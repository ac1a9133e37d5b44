"""Canonical JSON: the same data gives the same bytes, whoever writes it."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

__all__ = ["canonical"]


# What JSON allows as it stands, and could steer a terminal: an example may hold any byte as text.
_HIDDEN = "".join(map(chr, (*range(0x7F, 0xA0), 0xAD)))
_INDENTED = json.JSONEncoder(ensure_ascii=False, indent=2, sort_keys=True)
_ON_ONE_LINE = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"), sort_keys=True)


def canonical(data: dict[str, Any], lines: Collection[str] = ()) -> str:
    """Return ``data`` as JSON with sorted keys, two blanks of indent, and a final newline.

    :param lines: keys of long lists; each of their items stands on one line, without blanks in it.
    """
    text = _INDENTED.encode({key: [] if key in lines else value for key, value in data.items()})
    for key in lines:
        if data.get(key):
            items = ",\n    ".join(map(_ON_ONE_LINE.encode, data[key]))
            # No text of the data has a line feed in it, so that nothing else looks like this.
            text = text.replace(f'\n  "{key}": []', f'\n  "{key}": [\n    {items}\n  ]')
    for char in _HIDDEN:  # one after the other: most are in no text, and a search is quick
        if char in text:
            text = text.replace(char, f"\\u{ord(char):04x}")
    return text + "\n"

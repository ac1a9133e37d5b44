"""Notations: bytes as hex of JSON lines and as the documents print them; a command as it is typed."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any

_STRICT = re.compile(r"(?:[0-9A-Fa-f]{2})*\Z")


def from_hex(text: str) -> bytes:
    """Return the bytes of ``text``: hex digits in pairs and nothing else.

    Raises :class:`ValueError` with a plain sentence.
    """
    if not _STRICT.match(text):
        shown = text if len(text) <= 40 else f"{text[:40]}…"
        raise ValueError(f"{shown!r} is not bytes as pairs of hex digits")
    return bytes.fromhex(text)


def spaced(raw: bytes) -> str:
    """Return bytes as the documents print them: ``13 04 0E 00``."""
    return raw.hex(" ").upper()


def octets(entry: Mapping[str, Any], key: str) -> bytes:
    """Return bytes that an example writes in its notation: hex, ``24 97 03 58`` or ``#FF#41``."""
    text: str = entry[key]
    notation = entry.get("notation")
    if notation == "decimal":
        return bytes(int(number) for number in text.split())
    if notation == "hash":
        return bytes.fromhex(text.replace("#", ""))
    return bytes.fromhex(text)


def as_typed(words: Sequence[str]) -> str:
    """Return the words of a command as they are typed at a prompt of this system."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)

"""Notations for bytes in JSON and in documents, and for shell commands."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any

_STRICT = re.compile(r"(?:[0-9A-Fa-f]{2})*\Z")


def from_hex(text: str) -> bytes:
    """Return the bytes of a text that consists of pairs of hex digits.

    Raises :class:`ValueError` with a plain message.
    """
    if not _STRICT.match(text):
        shown = text if len(text) <= 40 else f"{text[:40]}…"
        raise ValueError(f"{shown!r} is not a sequence of two-digit hex bytes")
    return bytes.fromhex(text)


def spaced(raw: bytes) -> str:
    """Return bytes in the notation of the documents: ``13 04 0E 00``."""
    return raw.hex(" ").upper()


def octets(entry: Mapping[str, Any], key: str) -> bytes:
    """Return the bytes of an example in one of its notations: hex, ``24 97 03 58`` or ``#FF#41``."""
    text: str = entry[key]
    notation = entry.get("notation")
    if notation == "decimal":
        return bytes(int(number) for number in text.split())
    if notation == "hash":
        return bytes.fromhex(text.replace("#", ""))
    return bytes.fromhex(text)


def as_typed(words: Sequence[str]) -> str:
    """Return a command line for the shell of this system."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)

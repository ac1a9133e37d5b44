"""Hex text to bytes, strictly: what JSON lines and the registry's own files carry."""

from __future__ import annotations

import re

__all__ = ["from_hex", "spaced"]

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

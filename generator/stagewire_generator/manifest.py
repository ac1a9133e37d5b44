"""``manifest.json``: the digest of every generated file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from stagewire_generator.targets.canonical import canonical

__all__ = ["MANIFEST", "digest", "render"]

MANIFEST = "manifest.json"


def digest(text: str) -> str:
    """Return the SHA-256 of a text as it is written."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def render(digests: Mapping[str, str]) -> str:
    """Return the manifest of files by path -> digest; it does not list itself."""
    return canonical({"schema_version": 2, "files": dict(digests)})

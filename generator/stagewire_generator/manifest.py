"""``manifest.json``: the digest of every generated file, and of each resolved registry."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from stagewire_generator.targets.canonical import canonical

__all__ = ["MANIFEST", "digest", "render"]

MANIFEST = "manifest.json"
_REGISTRY = "registry/"


def digest(text: str) -> str:
    """Return the SHA-256 of a text as it is written."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def render(digests: Mapping[str, str]) -> str:
    """Return the manifest of files by path -> digest; it does not list itself."""
    registries = {
        path.removeprefix(_REGISTRY).removesuffix(".json"): sha
        for path, sha in digests.items()
        if path.startswith(_REGISTRY)
    }
    return canonical({"schema_version": 1, "registry": registries, "files": dict(digests)})

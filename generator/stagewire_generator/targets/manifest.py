"""``manifest.json``: the digest of every generated file, and of each resolved registry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from stagewire_generator.model import Protocol
from stagewire_generator.output import MANIFEST, digest
from stagewire_generator.targets.canonical import canonical

__all__ = ["render"]


def render(protocols: Sequence[Protocol], files: Mapping[str, str]) -> dict[str, str]:
    """Return the manifest of ``files``; it does not list itself."""
    data = {
        "schema_version": 1,
        "registry": {p.name: digest(files[f"registry/{p.name}.json"]) for p in protocols},
        "files": {path: digest(text) for path, text in files.items()},
    }
    return {MANIFEST: canonical(data)}

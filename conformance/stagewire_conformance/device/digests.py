"""What a report was made with: digests of the suite, the registry and the PICS."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable

from stagewire_conformance.device.declared import Declared

__all__ = ["digests_of"]


def digests_of(declared: Declared) -> dict[str, str]:
    """Return SHA-256 digests in hex: of ``suite``, ``registry`` and ``pics`` (empty where there is none)."""
    registry = resources.files(declared.protocol.package) / "registry.json"
    return {
        "suite": _of_suite(),
        "registry": hashlib.sha256(registry.read_bytes()).hexdigest(),
        "pics": declared.pics.digest,
    }


@cache
def _of_suite() -> str:
    """Return the digest of the source of the suite: of each file its path and what is in it."""
    digest = hashlib.sha256()
    for path, file in sorted(_files(resources.files(__package__), "")):
        digest.update(f"{path}\0".encode())
        digest.update(file.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return digest.hexdigest()


def _files(folder: Traversable, path: str) -> Iterator[tuple[str, Traversable]]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _files(entry, f"{path}{entry.name}/")
        elif entry.name.endswith(".py"):
            yield f"{path}{entry.name}", entry

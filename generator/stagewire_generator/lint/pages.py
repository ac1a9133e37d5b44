"""Pages: none beyond the last of the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["check_pages"]

_KINDS = ("protocol", "overlay", "quantities", "stages", "units", "messages", "errata", "rules")
_ROLES = {"set", "req", "get"}


def check_pages(
    protocol: Protocol, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Check every page of the registry against the number of pages, or of sections."""
    document = protocol.document
    last = len(document["sections"]) if "sections" in document else document.get("pages")
    if last is None:
        return
    noun = "section" if "sections" in document else "page"
    for file in (file for kind in _KINDS for file in files.get(kind, ())):
        for path, page in _pages(file.data, ()):
            if page > last and path[0] != "document":  # whose pages are their number
                what = f"{'.'.join(map(str, path))}: {noun} {page}; the last is {last}"
                diagnostics.add(file.place(*path), "SW039", what)


def _pages(node: Any, path: KeyPath) -> Iterator[tuple[KeyPath, int]]:
    """Yield every page in a part of a file; ``page`` may be the name of something else, too."""
    for key, part in node.items() if isinstance(node, dict) else enumerate(node):
        at = (*path, key)
        if key == "page" and isinstance(part, int):
            yield at, part
        elif key in ("pages", "more_pages", "also") and isinstance(part, list):
            yield from ((at, page) for page in part)
        elif key == "pages" and isinstance(part, dict) and part.keys() <= _ROLES:
            yield from ((at, page) for page in part.values())
        elif isinstance(part, dict | list):
            yield from _pages(part, at)

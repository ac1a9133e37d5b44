"""Which messages have worked examples: messages × examples × pages."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire.protocols import Protocol
from stagewire_conformance.registry import registry_of

__all__ = ["Coverage", "coverage"]


@dataclass(frozen=True, slots=True)
class Coverage:
    """How a message is covered.

    :param pages: where the document describes it.
    :param layouts: in how many forms it stands on the wire; 0 when no layout is documented.
    :param examples: worked examples of the document that are about it.
    :param example_pages: the pages of those.
    :param captures: frames of third parties.
    """

    message: str
    pages: tuple[int, ...]
    layouts: int
    examples: int
    example_pages: tuple[int, ...]
    captures: int


def coverage(protocol: Protocol) -> list[Coverage]:
    """Return one row for every message of the protocol, in the order of the registry."""
    vectors = protocol.vectors()
    pages: dict[str, list[int]] = {}
    for entry in vectors["examples"]:
        if entry.get("message"):
            pages.setdefault(entry["message"], []).append(entry["page"])
    captured = [entry.get("message") for entry in vectors["captures"]]
    return [
        Coverage(
            message=name,
            pages=tuple(message["pages"]),
            layouts=len(message["layouts"]),
            examples=len(pages.get(name, ())),
            example_pages=tuple(sorted(set(pages.get(name, ())))),
            captures=captured.count(name),
        )
        for name, message in registry_of(protocol).messages.items()
    ]

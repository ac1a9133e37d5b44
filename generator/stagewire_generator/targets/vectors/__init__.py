"""``vectors/<protocol>.json``: the worked examples and captures, for any implementation."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from stagewire_generator.model import Protocol
from stagewire_generator.targets.canonical import canonical

__all__ = ["render", "vectors_text"]


def render(protocol: Protocol) -> dict[str, str]:
    """Return the file of the vectors."""
    return {f"vectors/{protocol.name}.json": vectors_text(protocol)}


@lru_cache(maxsize=1)
def vectors_text(protocol: Protocol) -> str:
    """Return the vectors as canonical JSON; the Python package carries them, too."""
    return canonical(_vectors_json(protocol))


def _verdict(entry: dict[str, Any]) -> str:
    """Return the verdict of a prose example, which follows from its errata."""
    return "erratum" if entry.get("errata") else "reproduced"


def _vectors_json(protocol: Protocol) -> dict[str, Any]:
    """Return the examples and captures as lists, in the order of the document."""
    examples = protocol.examples.get("examples", {})
    captures = protocol.captures.get("captures", {})
    return {
        "schema_version": 1,
        "protocol": protocol.name,
        "examples": sorted(
            ({"id": id, "verdict": _verdict(entry), **entry} for id, entry in examples.items()),
            key=lambda entry: (entry["page"], entry.get("line", 0), entry["id"]),
        ),
        "captures": [{"id": id, **entry} for id, entry in captures.items()],
    }

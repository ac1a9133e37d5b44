"""The worked examples and captures of a registry, as lists."""

from __future__ import annotations

from stagewire_generator.model import Json, Protocol

__all__ = ["captures_of", "examples_of"]


def examples_of(protocol: Protocol) -> list[Json]:
    """Return the worked examples in the order of the document."""
    examples: Json = protocol.examples.get("examples", {})
    return sorted(
        ({"id": id, "verdict": _verdict(entry), **entry} for id, entry in examples.items()),
        key=lambda entry: (entry["page"], entry.get("line", 0), entry["id"]),
    )


def captures_of(protocol: Protocol) -> list[Json]:
    """Return the captures in the order of their file."""
    return [{"id": id, **entry} for id, entry in protocol.captures.get("captures", {}).items()]


def _verdict(entry: Json) -> str:
    """Return the verdict of a prose example, which follows from its errata."""
    return "erratum" if entry.get("errata") else "reproduced"

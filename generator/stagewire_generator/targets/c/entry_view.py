"""One row of the table of a protocol, whatever the framing."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["EntryView"]


@dataclass(frozen=True, slots=True)
class EntryView:
    """One row: its initialiser, and the name of its message as a literal."""

    code: str
    name: str

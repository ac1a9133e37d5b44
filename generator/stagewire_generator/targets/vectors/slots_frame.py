"""The bytes of commands in slots."""

from __future__ import annotations

from typing import Final

from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors.subject import Subject

__all__ = ["MOST", "SLOTS", "WITH", "WITHOUT", "Marks"]

WITH, WITHOUT = "request:with_size", "request:without_size"
SLOTS: Final = 3  # bytes before the data: axis, command, size
MOST: Final = SLOTS + 255 + 1  # bytes of the longest command


class Marks:
    """The bytes that mean something by themselves, and the axis that commands are sent to."""

    def __init__(self, protocol: Protocol) -> None:
        framing = protocol.framing
        self.prefix: int = framing["prefix"]
        self.terminator: int = framing["terminator"]
        self.setup = {
            message.id: message.name
            for message in protocol.messages
            if message.kind == "setup" and message.id is not None
        }
        axes = next(e for e in protocol.enumerations if e.name == framing["axes"])
        self.axis = axes.values[0].value

    def command(self, of: Subject, data: bytes, size: int | None, extra: bytes = b"") -> bytes:
        """Return the bytes of a command; ``size`` stands in its slot, which None leaves out."""
        assert of.message.id is not None
        slot = b"" if size is None else bytes((size,))
        head = bytes((self.axis, of.message.id))
        return head + slot + data + extra + bytes((self.terminator,))

"""The rule by which a stream of commands is read slot by slot, as simply as it can be said."""

from __future__ import annotations

from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors.slots_frame import MOST, SLOTS, Marks
from stagewire_generator.targets.vectors.streams import Piece, cut

__all__ = ["SlotsReader"]


class SlotsReader:
    """Reads what a host sends as the controller does."""

    def __init__(self, protocol: Protocol) -> None:
        self._marks = Marks(protocol)
        self._sizes: dict[
            int, tuple[int, int]
        ] = {}  # byte -> length of the data, number in the slot
        for message in protocol.messages:
            if message.kind == "command" and message.id is not None:
                request = next(layout for layout in message.layouts if layout.form == "request")
                self._sizes[message.id] = request.length, message.size or 0

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream consists of; adjacent garbage is joined."""
        return cut(stream, self._begins)

    def _begins(self, rest: bytes) -> tuple[str, int]:
        """Return what begins where a command is due, and its bytes."""
        prefix, end = self._marks.prefix, self._marks.terminator
        if rest[0] == end:
            return "garbage", 1
        if len(rest) < 2:
            return "pending", len(rest)
        if rest[0] == prefix:
            return ("message", 2) if rest[1] in self._marks.setup else self._garbage(rest, 1)
        if rest[1] == end:
            return "garbage", 2
        kind, data = "unknown", 2
        if rest[1] in self._sizes:
            if len(rest) < SLOTS:
                return "pending", len(rest)
            length, size = self._sizes[rest[1]]
            if rest[2] == end:
                return ("bad_length" if length else "message"), SLOTS
            right = rest[2] == size
            kind, data = ("message", SLOTS + length) if right else ("bad_length", SLOTS)
        found = rest.find(end, data, MOST)
        if found >= 0:
            return kind, found + 1
        return self._garbage(rest, MOST) if len(rest) >= MOST else ("pending", len(rest))

    def _garbage(self, rest: bytes, start: int) -> tuple[str, int]:
        """Return garbage up to the next terminator, or to the end of what has come."""
        found = rest.find(self._marks.terminator, start)
        return "garbage", found + 1 if found >= 0 else len(rest)

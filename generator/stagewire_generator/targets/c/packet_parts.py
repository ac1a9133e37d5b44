"""Where the parts of a packet stand, counted from its first byte or from the end of its payload."""

from __future__ import annotations

from stagewire_generator.model import Json

__all__ = ["PacketParts"]


class PacketParts:
    """The parts of the packets of one protocol.

    :param framing: as the registry has it.
    """

    def __init__(self, framing: Json) -> None:
        self.order: tuple[str, ...] = tuple(framing["order"])
        self._sizes = {
            part: len(framing[part]) if part in ("start", "end") else framing[part]["size"]
            for part in self.order
            if part != "payload"
        }
        self.counted = sum(self.size(part) for part in framing["length"]["counts"])
        self.payload_at = self.offset("payload")

    @property
    def overhead(self) -> int:
        """Bytes of a packet without payload."""
        return sum(self._sizes.values())

    def size(self, part: str) -> int:
        """Return the bytes of a part; 0 of the payload, whose length is not known before it comes."""
        return self._sizes.get(part, 0)

    def offset(self, part: str) -> int:
        """Return where a part stands in a packet without payload."""
        return sum(self.size(before) for before in self.order[: self.order.index(part)])

    def tail(self, part: str) -> int:
        """Return where a part stands that is behind the payload, counted from the end of that; 0 for none."""
        return self.offset(part) - self.payload_at if part in self.order else 0

    def is_behind(self, part: str) -> bool:
        """Whether a part stands behind the payload."""
        return self.order.index(part) > self.order.index("payload")

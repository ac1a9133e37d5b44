"""The rule by which a stream of packets is cut, as slowly and simply as it can be said."""

from __future__ import annotations

from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors.packet_frame import Packets
from stagewire_generator.targets.vectors.streams import Piece, cut

__all__ = ["PacketReader"]


class PacketReader:
    """Reads the streams of one protocol; packets look alike at both ends of the line."""

    def __init__(self, protocol: Protocol) -> None:
        self._packets = Packets(protocol)
        self._lengths = {
            message.id: {layout.length for layout in message.layouts}
            for message in protocol.messages
        }

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream consists of; adjacent garbage is joined."""
        return cut(stream, self._begins)

    def _begins(self, rest: bytes) -> tuple[str, int]:
        """Return what begins with the first byte, and its bytes."""
        packets = self._packets
        if rest[: len(packets.start)] != packets.start[: len(rest)]:
            return "garbage", 1
        if len(rest) < packets.place("length", 0).stop:
            return "pending", len(rest)
        payload = packets.number("length", rest, 0) - packets.counted
        if not 0 <= payload <= packets.most:
            return "garbage", 1
        size = packets.least + payload
        if len(rest) < size:
            return "pending", len(rest)
        packet = rest[:size]
        id = packets.number("id", packet, payload)
        address = packets.number("address", packet, payload)
        if packet != packets.pack(id, address, packet[packets.place("payload", payload)]):
            return "garbage", 1
        if id not in self._lengths:
            return "unknown", size
        longest = max((n for n in self._lengths[id] if n <= payload), default=None)
        fits = longest is not None and (longest or not payload)
        return ("message" if fits else "bad_length"), size

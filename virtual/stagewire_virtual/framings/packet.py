"""Packets with a start, a length or an end, and a checksum; the same in both directions."""

from __future__ import annotations

from collections.abc import Collection

from stagewire.framing import Event
from stagewire.protocols import PacketProtocol
from stagewire_virtual.framings.framing import Abandon, Framing, ReplyReader, StreamFramer, decoded


class PacketFraming(Framing):
    """The framing of a protocol of packets."""

    protocol: PacketProtocol

    def request_framer(self) -> tuple[StreamFramer, Abandon | None]:
        """Return a framer for packets."""
        framer = self.protocol.framer()
        return framer, framer.abandon

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return a reader for packets."""
        return _PacketReader(self.protocol)

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of the message of a packet."""
        packet = decoded(self.protocol.decode, raw)
        return None if packet is None else packet.message.layout.message


class _PacketReader(ReplyReader):
    """Decodes packets."""

    def __init__(self, protocol: PacketProtocol) -> None:
        self._framer = protocol.framer()

    def read(self, data: bytes) -> list[Event]:
        return list(self._framer.feed(data))

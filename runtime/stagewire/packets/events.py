"""The events that a framer of packets gives out, beside :class:`~stagewire.framing.events.Garbage`.

The other events of :mod:`stagewire.framing` do not fit: their bytes begin with a header.
"""

from __future__ import annotations

from collections.abc import Callable

from stagewire.framing.events import Event

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from stagewire.packets.packet import Packet

__all__ = ["BadPacketLength", "PacketReceived", "UnknownPacket"]


class PacketReceived(Event):
    """A message of a known layout, perhaps with extra bytes."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], Packet]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], Packet]) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def packet(self) -> Packet:
        """The decoded packet, made anew each time that it is asked for."""
        return self.decoder(self.raw)


class UnknownPacket(Event):
    """A whole packet with an id that no message has."""

    __slots__ = ()


class BadPacketLength(Event):
    """A whole packet of a known message whose payload fits none of its layouts."""

    __slots__ = ()

"""What generated messages of packets stand on: they are a payload and nothing else."""

from __future__ import annotations

from stagewire.message import Message

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import ClassVar, Self

    from stagewire.packets.shape import Shape

__all__ = ["PacketMessage"]


class PacketMessage(Message, abstract=True):
    """Base of messages that a packet carries.

    Messages without a payload need nothing more; those with one bring ``unpack`` and ``pack``.
    """

    __slots__ = ()
    if TYPE_CHECKING:
        shape: ClassVar[Shape]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the message from its payload, without any check; what follows its layout is left."""
        return cls()

    def pack(self) -> bytes:
        """Return the bytes of the payload."""
        return b""

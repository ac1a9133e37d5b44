"""Packets with their messages and events: a payload, an address, and any bytes beyond the layout."""

from __future__ import annotations

from collections.abc import Callable

from stagewire._codec.events import Event, Frozen
from stagewire._codec.message import Message
from stagewire.errors import BadValueError, OutOfRangeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, ClassVar, Self

    from stagewire._framings.packet.shape import Shape


class PacketMessage(Message, abstract=True):
    """Base of messages that a packet carries.

    Messages without a payload need no methods; the others define ``unpack`` and ``pack``.
    """

    __slots__ = ()
    if TYPE_CHECKING:
        shape: ClassVar[Shape]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the message in a payload, without any check; ignore bytes after its layout."""
        return cls()

    def pack(self) -> bytes:
        """Return the bytes of the payload."""
        return b""


class Packet(Frozen):
    """A message with its address; immutable.

    :param message: the message.
    :param address: address of the controller; None in a protocol without addresses.
    :param extra: bytes of the payload beyond the layout, as newer controllers send them.
    """

    __slots__ = ("address", "extra", "message")
    __match_args__ = ("message", "address", "extra")
    message: PacketMessage
    address: int | None
    extra: bytes

    def __new__(
        cls, message: PacketMessage, address: int | None = None, extra: bytes = b""
    ) -> Packet:
        """Make a packet.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an address that does not fit, and
        :class:`~stagewire.errors.BadValueError` for an argument of the wrong type, for an address if packets
        have none, and for extra bytes with a message that has no payload.
        """
        if not isinstance(message, PacketMessage):
            raise BadValueError(f"a packet carries a message of its protocol, not {message!r}")
        address = _checked_address(message.shape, address)
        if extra.__class__ is not bytes:
            if not isinstance(extra, (bytes, bytearray, memoryview)):
                raise BadValueError(f"extra must be bytes, not {extra!r}")
            extra = bytes(extra)
        if extra and not message.layout.length:
            raise BadValueError(f"{message.layout.message} has no payload to add extra bytes to")
        return make_packet(message, address, extra)

    def encode(self) -> bytes:
        """Return the bytes of the packet.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a payload that is too long.
        """
        shape = self.message.shape
        payload = self.message.pack() + self.extra
        if len(payload) > shape.maximum:
            raise OutOfRangeError(
                f"a payload has at most {shape.maximum} bytes, not {len(payload)}"
            )
        return shape.pack(self.message.layout.id, self.address, payload)

    def _key(self) -> tuple[PacketMessage, int | None, bytes]:
        return self.message, self.address, self.extra

    def __reduce__(self) -> tuple[Any, ...]:
        return make_packet, self._key()

    def __repr__(self) -> str:
        parts = [repr(self.message)]
        if self.address is not None:
            parts.append(f"address={self.address:#04x}")
        if self.extra:
            parts.append(f"extra={self.extra!r}")
        return f"Packet({', '.join(parts)})"


def _checked_address(shape: Shape, address: object) -> int | None:
    """Return the address as a plain integer; raise if packets of this shape cannot hold it."""
    if not shape.address:
        if address is not None:
            raise BadValueError(
                f"packets of this protocol have no address: {address!r} is not None"
            )
        return None
    most = (1 << 8 * shape.address) - 1
    if isinstance(address, bool) or not isinstance(address, int):
        raise BadValueError(f"address must be an integer from 0 to {most:#04x}, not {address!r}")
    if not 0 <= address <= most:
        raise OutOfRangeError(f"address must be 0 to {most:#04x}, not {int(address)}")
    return int(address)


class _Draft(Frozen):
    """A packet while it is being filled; :mod:`stagewire._codec.events` explains why."""

    __slots__ = Packet.__slots__
    __setattr__ = object.__setattr__
    __delattr__ = object.__delattr__
    message: PacketMessage
    address: int | None
    extra: bytes


def make_packet(message: PacketMessage, address: int | None, extra: bytes = b"") -> Packet:
    """Return a packet of parts that are known to be valid."""
    draft: Any = _Draft()
    draft.message = message
    draft.address = address
    draft.extra = extra
    draft.__class__ = Packet
    packet: Packet = draft
    return packet


class PacketReceived(Event):
    """A message with a known layout, perhaps with extra bytes."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], Packet]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], Packet]) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def packet(self) -> Packet:
        """The decoded packet, decoded again on each access."""
        return self.decoder(self.raw)


class UnknownPacket(Event):
    """A whole packet with an unknown id."""

    __slots__ = ()


class BadPacketLength(Event):
    """A whole packet of a known message whose payload fits none of its layouts."""

    __slots__ = ()

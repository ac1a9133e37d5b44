"""What a host sends, cut into frames, for who stands between a host and a controller."""

from __future__ import annotations

import typing

from stagewire.commands import CommandProtocol
from stagewire.errors import CodecError, UnsupportedError
from stagewire.framed import FramedProtocol
from stagewire.framing import End, Event
from stagewire.packets import PacketProtocol
from stagewire.protocol import Protocol

__all__ = ["Cutter", "cutter_of", "message_name"]


class Cutter(typing.Protocol):
    """What cuts a stream into events; the bytes of all events are the bytes that were fed."""

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return what they complete."""
        ...


def cutter_of(protocol: Protocol) -> Cutter:
    """Return what cuts the stream from a host.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol that is framed in no known way.
    """
    if isinstance(protocol, FramedProtocol):
        return protocol.framer(End.DEVICE)
    if isinstance(protocol, (CommandProtocol, PacketProtocol)):
        return protocol.framer()
    raise UnsupportedError(f"nothing cuts {protocol!r} into frames")


def message_name(protocol: Protocol, raw: bytes) -> str | None:
    """Return the name of the message that a frame carries; None when it is none that is known.

    A reply of a protocol of commands does not say what it is.
    """
    if not isinstance(protocol, (FramedProtocol, CommandProtocol, PacketProtocol)):
        return None
    try:
        return protocol.decode(raw).message.layout.message
    except CodecError:
        return None

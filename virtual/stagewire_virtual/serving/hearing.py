"""What a host makes of the bytes of a controller: events with messages in them."""

from __future__ import annotations

from collections.abc import Collection

from stagewire.framing import Asking, End, Event, Replies
from stagewire.protocols import CommandProtocol, FramedProtocol, PacketProtocol, Protocol
from stagewire_virtual.errors import VirtualError


class Hearing:
    """Reads a conversation from the side of the host; the base of those of all framings."""

    def wrote(self, data: bytes) -> None:
        """Note what the host has sent."""

    def heard(self, data: bytes) -> list[Event]:
        """Return what bytes of the controller complete."""
        raise NotImplementedError


def hearing_of(protocol: Protocol, statuses: Collection[str | None]) -> Hearing:
    """Return the hearing for a protocol.

    :param statuses: which status blocks the far end sends; of those that bytes do not tell apart, one.

    Raises :class:`~stagewire_virtual.errors.VirtualError` for a protocol that cannot be read.
    """
    match protocol:
        case CommandProtocol():
            return _Replies(protocol)
        case FramedProtocol():
            return _Frames(protocol, statuses)
        case PacketProtocol():
            return _Packets(protocol)
    raise VirtualError(f"{protocol.name} has no frames that could be read; read() returns bytes")


class _Frames(Hearing):
    """Frames that say themselves what they are, but for their status block."""

    def __init__(self, protocol: FramedProtocol, statuses: Collection[str | None]) -> None:
        self._framer = protocol.framer(End.HOST)
        deciding = {cls.layout.when.get("status") for cls in protocol.messages}
        # By some quirks a controller calls itself 0, or what the host is called.
        sources = {*protocol.devices, protocol.host, 0}
        for status in sorted(filter(None, deciding.intersection(statuses))):
            for source in sources:
                self._framer.tell(source, status=status)

    def heard(self, data: bytes) -> list[Event]:
        return self._framer.feed(data)


class _Packets(Hearing):
    """Packets, alike in both directions."""

    def __init__(self, protocol: PacketProtocol) -> None:
        self._framer = protocol.framer()

    def heard(self, data: bytes) -> list[Event]:
        return list(self._framer.feed(data))


class _Replies(Hearing):
    """Replies without a frame, which are cut by the requests in front of them.

    All that is written before the next reading is asked at once; who asks after a reading has given up what
    has not been answered by then.
    """

    def __init__(self, protocol: CommandProtocol) -> None:
        self._replies = Replies()
        self._asking = Asking(protocol, self._replies)
        self._has_asked = False

    def wrote(self, data: bytes) -> None:
        self._asking.feed(data, goes_on=self._has_asked)
        self._has_asked = True

    def heard(self, data: bytes) -> list[Event]:
        self._has_asked = False
        return self._replies.feed(data)

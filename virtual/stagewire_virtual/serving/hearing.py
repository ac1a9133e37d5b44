"""What a host makes of the bytes of a controller: events with messages in them."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from typing import Final

from stagewire.commands import CommandFrame, CommandProtocol, CommandReceived, ReplyReceived
from stagewire.framed import FramedProtocol
from stagewire.framing import End, Event, Garbage
from stagewire.packets import PacketProtocol
from stagewire.protocol import Protocol
from stagewire_virtual.errors import VirtualError

__all__ = ["Hearing", "hearing_of"]

_OUTSTANDING: Final = 64


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
        for status in filter(None, deciding.intersection(statuses)):
            for source in protocol.devices:
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

    All that is written before the next reading is taken to have been asked; what was asked before the last
    reading and not answered by then is given up.
    """

    def __init__(self, protocol: CommandProtocol) -> None:
        self._framer = protocol.framer()
        self._asked: deque[CommandFrame] = deque(maxlen=_OUTSTANDING)
        self._read = False
        self._pending = b""

    def wrote(self, data: bytes) -> None:
        if self._read:
            self._asked.clear()
            self._pending = b""
            self._read = False
        for event in self._framer.feed(data):
            if isinstance(event, CommandReceived) and event.frame.message.reply is not None:
                self._asked.append(event.frame)

    def heard(self, data: bytes) -> list[Event]:
        self._read = True
        events: list[Event] = []
        data = self._pending + data
        while data and self._asked:
            reply = self._asked[0].message.reply
            assert reply is not None  # else it would not have been noted
            size = reply.layout.length
            if len(data) < size:
                break
            events.append(ReplyReceived(data[:size], self._asked.popleft()))
            data = data[size:]
        self._pending = data if self._asked else b""
        if data and not self._asked:
            events.append(Garbage(data))
        return events

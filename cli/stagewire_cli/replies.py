"""Both directions of a line on which replies have no frame: what was asked tells what comes."""

from __future__ import annotations

from collections import deque

from stagewire.commands import CommandFrame, CommandReceived, ReplyReceived
from stagewire.framing import Event, Garbage
from stagewire_conformance.codec.base import Reader

__all__ = ["Asking", "Replies"]

_OUTSTANDING = 64  # requests whose replies are awaited at once; older ones are forgotten


class Replies:
    """Cuts what a controller sends into the replies to what is outstanding, in their order.

    A host has one request outstanding, or sends several at once. One that asks again has given up what it
    asked before: a reply that was lost does not shift all that follow.
    """

    def __init__(self) -> None:
        self._outstanding: deque[CommandFrame] = deque(maxlen=_OUTSTANDING)
        self._asks_again = False
        self.pending = b""

    def turn(self) -> None:
        """Note that the host begins to speak."""
        self._asks_again = True

    def asked(self, frame: CommandFrame) -> None:
        """Note a command; what has no reply, such as a stop, gives nothing up."""
        if frame.message.reply is None:
            return
        if self._asks_again:
            self._asks_again = False
            self._outstanding.clear()
            self.pending = b""
        self._outstanding.append(frame)

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return the replies that they complete."""
        data = self.pending + data
        events: list[Event] = []
        while data and self._outstanding:
            reply = self._outstanding[0].message.reply
            assert reply is not None  # else it would not be outstanding
            size = reply.layout.length
            if len(data) < size:
                break
            events.append(ReplyReceived(data[:size], self._outstanding.popleft()))
            data = data[size:]
        if data and not self._outstanding:
            events.append(Garbage(data))
            data = b""
        self.pending = data
        return events


class Asking:
    """Cuts what a host sends into commands, and tells which replies they have.

    :param commands: cuts it.
    :param replies: are told.
    """

    def __init__(self, commands: Reader, replies: Replies) -> None:
        self._commands = commands
        self._replies = replies

    @property
    def pending(self) -> bytes | bytearray | memoryview:
        """The bytes that wait for more."""
        return self._commands.pending

    def feed(self, data: bytes) -> list[Event]:
        """Take what a host sends at once and return the commands that it completes."""
        self._replies.turn()
        events = self._commands.feed(data)
        for event in events:
            if isinstance(event, CommandReceived):
                self._replies.asked(event.frame)
        return events

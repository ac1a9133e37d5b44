"""Replies on a line that is only listened to, cut by what was asked on it before."""

from __future__ import annotations

from collections import deque
from typing import Final

from stagewire.commands.frame import CommandFrame
from stagewire.commands.replies import ReplyReceived
from stagewire.framing.events import Event, Garbage

__all__ = ["Replies"]

_OUTSTANDING: Final = 64  # requests whose replies are awaited at once; older ones are forgotten


class Replies:
    """Cuts what a controller sends into the replies to what is outstanding, in their order.

    For whoever listens and has no say in what is asked when, such as a log; a host has a
    :class:`~stagewire.commands.ReplyDecoder`. What a host sends at once is asked together. A host that asks
    again has given up what it asked before: a reply that was lost does not shift all that follow, and what
    came of it is garbage.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    """

    def __init__(self) -> None:
        self._outstanding: deque[CommandFrame] = deque(maxlen=_OUTSTANDING)
        self._asks_again = False
        self.pending = b""
        """The beginning of a reply."""
        self._given_up = 0  # bytes of it that belong to a reply that nobody waits for any more

    def turn(self) -> None:
        """Note that the host begins to speak, or will be when it speaks next."""
        self._asks_again = True

    def asked(self, frame: CommandFrame) -> None:
        """Note a command; what has no reply, such as a stop, gives nothing up."""
        if frame.message.reply is None:
            return
        if self._asks_again:
            self._asks_again = False
            self._outstanding.clear()
            self._given_up = len(self.pending)
        self._outstanding.append(frame)

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return the replies that they complete."""
        data = self.pending + data
        events: list[Event] = []
        if self._given_up:
            events.append(Garbage(data[: self._given_up]))
            data, self._given_up = data[self._given_up :], 0
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

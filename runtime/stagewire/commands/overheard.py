"""Both directions of a line that is only listened to: what was asked tells what a reply is."""

from __future__ import annotations

from collections import deque
from typing import Final

from stagewire.commands.events import CommandReceived, TextReceived
from stagewire.commands.formats import LONGEST_LINE, host_framer
from stagewire.commands.frame import CommandFrame
from stagewire.commands.protocol import CommandProtocol
from stagewire.commands.replies import ReplyReceived
from stagewire.framing.events import Event, Garbage

__all__ = ["Asking", "Replies"]

_OUTSTANDING: Final = 64  # requests whose replies are awaited at once; older ones are forgotten


class Replies:
    """Cuts what a controller sends into the replies to what is outstanding, in their order.

    For whoever listens and has no say in what is asked when, such as a log; a host has a
    :class:`~stagewire.commands.ReplyDecoder`. What a host sends at once is asked together. A host that asks
    again has given up what it asked before: a reply that was lost does not shift all that follow, and what
    came of it is garbage. A line of text is answered by a line that ends with a line feed; by several, when
    nothing was asked after it.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    """

    def __init__(self) -> None:
        self._outstanding: deque[CommandFrame | TextReceived] = deque(maxlen=_OUTSTANDING)
        self._asks_again = False
        self.pending = b""
        """The beginning of a reply."""
        self._given_up = 0  # bytes of it that belong to a reply that nobody waits for any more

    def turn(self) -> None:
        """Note that the host begins to speak, or will be when it speaks next."""
        self._asks_again = True

    def asked(self, request: CommandFrame | TextReceived) -> None:
        """Note what was asked; what has no reply, such as a stop or an empty line, gives nothing up."""
        if isinstance(request, TextReceived):
            if not request.raw.strip():
                return
        elif request.message.reply is None:
            return
        if self._asks_again:
            self._asks_again = False
            self._outstanding.clear()
            self._given_up = len(self.pending)
        self._outstanding.append(request)

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return the replies that they complete."""
        data = self.pending + data
        events: list[Event] = []
        if self._given_up:
            events.append(Garbage(data[: self._given_up]))
            data, self._given_up = data[self._given_up :], 0
        while data and self._outstanding:
            request = self._outstanding[0]
            event = _reply(request, data)
            if event is None:
                break
            events.append(event)
            data = data[len(event.raw) :]
            if not isinstance(request, TextReceived) or len(self._outstanding) > 1:
                self._outstanding.popleft()
        if data and not self._outstanding:
            events.append(Garbage(data))
            data = b""
        self.pending = data
        return events


class Asking:
    """Cuts what a host sends, in whichever format, and tells which replies it asks for.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.

    :param protocol: of the line.
    :param replies: are told.
    """

    def __init__(self, protocol: CommandProtocol, replies: Replies) -> None:
        self._framer = host_framer(protocol)
        self._replies = replies

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more."""
        return self._framer.pending

    def feed(self, data: bytes, *, goes_on: bool = False) -> list[Event]:
        """Take what a host sends and return what it completes.

        :param goes_on: whether what is asked belongs together with what was sent before.
        """
        if not goes_on:
            self._replies.turn()
        events = self._framer.feed(data)
        for event in events:
            if isinstance(event, CommandReceived):
                self._replies.asked(event.frame)
            elif isinstance(event, TextReceived):
                self._replies.asked(event)
        return events


def _reply(request: CommandFrame | TextReceived, data: bytes) -> Event | None:
    """Return the reply that bytes begin with, None when it is not all there."""
    if isinstance(request, TextReceived):
        size = data.find(b"\n", 0, LONGEST_LINE) + 1
        if size:
            return TextReceived(data[:size])
        return None if len(data) < LONGEST_LINE else Garbage(data[:LONGEST_LINE])
    reply = request.message.reply
    assert reply is not None  # else it would not be outstanding
    size = reply.layout.length
    return None if len(data) < size else ReplyReceived(data[:size], request)

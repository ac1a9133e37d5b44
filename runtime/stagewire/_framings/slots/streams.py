"""Framers for hosts that send both commands and lines of text, and for listeners on such a line.

Setup commands switch the format. Single bytes do not show the format, so the framer follows it, using
``switches_to`` of the setup commands in the registry:

1. ``low_level``: commands, cut by a :class:`~stagewire.framing.CommandFramer`.
2. ``high_level``: text. A line ends with a carriage return; a line feed at the beginning of a line is an
   empty line. The prefix and the byte of a setup command form one at any position. A line that a setup
   command interrupts is garbage, and so is a line of more than 4096 bytes.
3. ``power_on``, also the initial format: the format of a controller after power-on is unknown. The input is
   text until something that is not text: a byte that is not printable ASCII, carriage return, line feed, tab
   or backspace, or a terminator at the beginning of a line. From there on it is commands. No documented axis
   is a text byte.

Chunking does not matter after :func:`~stagewire.framing.join_garbage`, and less than one longest line is
pending between feeds.
"""

from __future__ import annotations

import re
from collections import deque
from typing import TYPE_CHECKING, Final

from stagewire._codec.events import Event, Garbage, fed
from stagewire._framings.slots.frame import CommandFrame, CommandReceived, TextReceived
from stagewire._framings.slots.framer import CommandFramer
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._framings.slots.replies import ReplyReceived

if TYPE_CHECKING:
    from stagewire._codec.message import CommandFormat

LONGEST_LINE: Final = 4096
"""Bytes of the longest line, including its end; longer input is not text."""

_TEXT_BYTES: Final = rb" -~\r\n\t\b"  # for a set in a pattern


def host_framer(protocol: CommandProtocol) -> CommandFramer | FormatFramer:
    """Return a framer for everything that a host sends; for commands only if no command switches."""
    return FormatFramer(protocol) if _switches(protocol) else protocol.framer()


class FormatFramer:
    """A framer that cuts the bytes from a host into commands and lines of text.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. No input makes
    :meth:`feed` raise.

    :param protocol: the protocol of the commands; some of its setup commands switch the format.
    """

    def __init__(self, protocol: CommandProtocol) -> None:
        marks = protocol.marks
        self._protocol = protocol
        self._framer = protocol.framer()
        self._format: CommandFormat = "power_on"
        self._switches = _switches(protocol)
        self._line = b""
        self._too_long = False  # the rest of the line is garbage
        self._prefix, self._end = bytes((marks.prefix,)), bytes((marks.terminator,))
        prefix, setup = re.escape(self._prefix), re.escape(bytes(marks.setup))
        pair = rb"%b[%b]" % (prefix, setup)
        self._pair = re.compile(pair, re.DOTALL)
        no_text = rb"[^%b%b]|%b[^%b]" % (_TEXT_BYTES, prefix, prefix, setup)
        ends = rb"(?P<line>\r)|(?P<setup>%b)" % pair
        self._ends = {
            "high_level": re.compile(ends),
            "power_on": re.compile(rb"%b|(?P<command>%b)" % (ends, no_text)),
        }

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more: the beginning of a line or a command."""
        return self._line or self._framer.pending

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return the events that they complete.

        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data`` is not bytes.
        """
        data = self._line + fed(data)
        self._line = b""
        events: list[Event] = []
        at = 0
        while at < len(data):
            take = self._take_commands if self._format == "low_level" else self._take_text
            at = take(data, at, events)
        return events

    def _take_commands(self, data: bytes, at: int, events: list[Event]) -> int:
        """Cut commands, up to one that may switch the format; return the position after it."""
        framer = self._framer
        if framer.pending.endswith(self._prefix):  # the rest of a setup command may come first
            end = at + 1
        else:
            found = self._pair.search(data, at)
            end = found.end() if found else len(data)
        new = framer.feed(data[at:end])
        events += new
        if new and isinstance(new[-1], CommandReceived):
            self._switch(new[-1].raw)
        return end

    def _take_text(self, data: bytes, at: int, events: list[Event]) -> int:
        """Cut one line, or the command that interrupts it; return the position after it."""
        first = data[at : at + 1]
        if not self._too_long:
            if first == b"\n":
                events.append(TextReceived(first))
                return at + 1
            if self._format == "power_on" and first == self._end:
                self._format = "low_level"
                return at
        found = self._ends[self._format].search(data, at)
        if found is None:
            self._wait(data[at:], events)
            return len(data)
        start, end = found.span()
        if found.lastgroup == "line":
            fits = not self._too_long and end - at <= LONGEST_LINE
            events.append(TextReceived(data[at:end]) if fits else Garbage(data[at:end]))
        else:
            if at < start:
                events.append(Garbage(data[at:start]))
            if found.lastgroup == "command":
                self._format = "low_level"
                end = start
            else:
                events.append(CommandReceived(found.group(), self._protocol.decode))
                self._switch(found.group())
        self._too_long = False
        return end

    def _wait(self, line: bytes, events: list[Event]) -> None:
        """Keep an incomplete line; if it is too long, keep only the possible start of a setup command."""
        if not self._too_long and len(line) < LONGEST_LINE:
            self._line = line
            return
        self._too_long = True
        if line.endswith(self._prefix):
            self._line = self._prefix
            line = line[:-1]
        if line:
            events.append(Garbage(line))

    def _switch(self, command: bytes) -> None:
        """Switch to the format of a setup command; ignore all other commands."""
        self._format = self._switches.get(command, self._format)


def _switches(protocol: CommandProtocol) -> dict[bytes, CommandFormat]:
    """Return the two bytes of each setup command that switches the format -> the new format."""
    prefix = protocol.marks.prefix
    layouts = (cls.layout for cls in protocol.messages)
    return {bytes((prefix, one.id)): one.switches_to for one in layouts if one.switches_to}


_OUTSTANDING: Final = 64  # requests whose replies are awaited; older ones are dropped


class ReplyListener:
    """A listener that cuts the bytes from a controller into replies to the outstanding requests, in order.

    For listeners that do not control the requests, such as a log. A host uses a
    :class:`~stagewire.framing.ReplyDecoder`. Requests that a host sends together are awaited together. If the
    host sends again, it has given up its earlier requests. A lost reply therefore does not shift the later
    ones, and the partial reply is garbage. The reply to a line of text is one line that ends with a line
    feed, or several if no other request follows.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    """

    def __init__(self) -> None:
        self._outstanding: deque[CommandFrame | TextReceived] = deque(maxlen=_OUTSTANDING)
        self._asks_again = False
        self.pending = b""
        """The beginning of a reply."""
        self._given_up = 0  # bytes of it that belong to an abandoned reply

    def turn(self) -> None:
        """Note that the host begins a new turn with its next request."""
        self._asks_again = True

    def asked(self, request: CommandFrame | TextReceived) -> None:
        """Note a request. Commands without a reply, such as a stop, and empty lines are ignored."""
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


class HostListener:
    """A listener that cuts the bytes from a host, in either format, and passes requests to a reply listener.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.

    :param protocol: the protocol of the line.
    :param replies: the listener for the replies.
    """

    def __init__(self, protocol: CommandProtocol, replies: ReplyListener) -> None:
        self._framer = host_framer(protocol)
        self._replies = replies

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more."""
        return self._framer.pending

    def feed(self, data: bytes, *, goes_on: bool = False) -> list[Event]:
        """Take the next bytes from the host and return the events that they complete.

        :param goes_on: whether these requests belong to the same turn as the previous ones.
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
    """Return the reply at the beginning of ``data``; None if it is incomplete."""
    if isinstance(request, TextReceived):
        size = data.find(b"\n", 0, LONGEST_LINE) + 1
        if size:
            return TextReceived(data[:size])
        return None if len(data) < LONGEST_LINE else Garbage(data[:LONGEST_LINE])
    reply = request.message.reply
    assert reply is not None  # else it would not be outstanding
    size = reply.layout.length
    return None if len(data) < size else ReplyReceived(data[:size], request)

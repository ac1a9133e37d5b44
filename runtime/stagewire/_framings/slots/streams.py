"""What a host sends to a controller that takes lines of text beside commands, cut in either format.

Setup commands switch, and two bytes alone cannot tell which format they are in. So the format is followed,
as the registry has it in ``switches_to`` of a setup command:

1. ``low_level``: what comes is commands, cut by a :class:`~stagewire.framing.CommandFramer`.
2. ``high_level``: what comes is text. A line ends with a carriage return; a line feed where a line is due is
   an empty line. The prefix and the byte of a setup command are one anywhere; a line that it interrupts is
   garbage, and so is one of more than 4096 bytes.
3. ``power_on``, which is that of the beginning, too: nobody can say in which format a controller wakes. Text
   is text until something is no text (neither printable ASCII, carriage return, line feed, tab nor
   backspace; or a terminator where a line is due). From there on it is commands. No documented axis is text.

Any chunking gives the same after :func:`~stagewire.framing.join_garbage`, and less than one longest line is
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
"""Bytes of a line with its end; what is longer is no text."""

_TEXT_BYTES: Final = rb" -~\r\n\t\b"  # for a set in a pattern


def host_framer(protocol: CommandProtocol) -> CommandFramer | FormatFramer:
    """Return what cuts everything that a host sends; where nothing switches, that is commands alone."""
    return FormatFramer(protocol) if _switches(protocol) else protocol.framer()


class FormatFramer:
    """Cuts what a host sends into commands and lines of text.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    Nothing that comes from outside makes :meth:`feed` raise.

    :param protocol: of the commands; some of its setup commands switch the format.
    """

    def __init__(self, protocol: CommandProtocol) -> None:
        marks = protocol.marks
        self._protocol = protocol
        self._framer = protocol.framer()
        self._format: CommandFormat = "power_on"
        self._switches = _switches(protocol)
        self._line = b""
        self._too_long = False  # what comes up to the end of the line is garbage
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
        """Take the next bytes of the stream and return what they complete.

        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
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
        """Cut commands, up to one that may switch; return the place behind."""
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
        """Cut one line, or what interrupts it; return the place behind."""
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
        """Keep the beginning of a line, as far as one can be long; else only what may be a setup command."""
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
        """Follow a setup command that switches; others, and all that is none, change nothing."""
        self._format = self._switches.get(command, self._format)


def _switches(protocol: CommandProtocol) -> dict[bytes, CommandFormat]:
    """Return the two bytes of each setup command that switches, and the format that it switches to."""
    prefix = protocol.marks.prefix
    layouts = (cls.layout for cls in protocol.messages)
    return {bytes((prefix, one.id)): one.switches_to for one in layouts if one.switches_to}


_OUTSTANDING: Final = 64  # requests whose replies are awaited at once; older ones are forgotten


class ReplyListener:
    """Cuts what a controller sends into the replies to what is outstanding, in their order.

    For whoever listens and has no say in what is asked when, such as a log; a host has a
    :class:`~stagewire.framing.ReplyDecoder`. What a host sends at once is asked together. A host that asks
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


class HostListener:
    """Cuts what a host sends, in whichever format, and tells which replies it asks for.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.

    :param protocol: of the line.
    :param replies: are told.
    """

    def __init__(self, protocol: CommandProtocol, replies: ReplyListener) -> None:
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

"""What a host sends to a controller that takes lines of text beside commands, cut in either format.

Setup commands switch, and two bytes alone cannot tell which format they are in. So the format is followed,
as the registry has it in ``switches_to`` of a setup command:

1. ``low_level``: what comes is commands, cut by a :class:`~stagewire.commands.CommandFramer`.
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
from typing import TYPE_CHECKING, Final

from stagewire.commands.events import CommandReceived, TextReceived
from stagewire.commands.framer import CommandFramer
from stagewire.commands.protocol import CommandProtocol
from stagewire.framing.events import Event, Garbage, fed

if TYPE_CHECKING:
    from stagewire.message import CommandFormat

__all__ = ["LONGEST_LINE", "FormatFramer", "host_framer"]

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

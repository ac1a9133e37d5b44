"""The framer of commands: bytes in, events out. The rule is stated in :mod:`stagewire.commands`."""

from __future__ import annotations

from collections.abc import Callable

from stagewire.commands.events import CommandReceived
from stagewire.commands.frame import CommandFrame
from stagewire.commands.rule import MORE, Rule
from stagewire.framing.events import Event, Garbage, fed

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["CommandFramer"]

_NEVER: Final = 1 << 62  # the size of a command that no buffer will ever hold


class CommandFramer:
    """Cuts what a host sends into events, as the controller at the other end reads it.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    Nothing that comes from outside makes it raise.

    :param rule: what framing has to know of the protocol.
    :param decode: makes a frame of the bytes of one command, for ``event.frame``.
    """

    __slots__ = ("_decode", "_in_garbage", "_pending", "_rule")

    def __init__(self, rule: Rule, decode: Callable[[bytes], CommandFrame]) -> None:
        self._rule = rule
        self._decode = decode
        self.reset()

    def reset(self) -> None:
        """Forget what is pending; a command is due, as at the beginning of a stream."""
        self._pending = b""
        self._in_garbage = False

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more to come: the beginning of a command."""
        return self._pending

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return what they complete.

        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
        """
        data = fed(data)
        if self._pending:
            data = self._pending + data
        available = len(data)
        events: list[Event] = []
        append, new, decode = events.append, object.__new__, self._decode
        rule = self._rule
        size_of, marks = rule.usual.get, rule.marks
        terminator, no_axes = marks.terminator, (marks.prefix, marks.terminator)
        position = garbage = 0  # what is before `garbage` is given out; up to position is garbage
        if self._in_garbage:
            end = rule.find_end(data, 0)
            position = available if end == MORE else end
            self._in_garbage = end == MORE
        while position < available:
            # The commands that most streams consist of: nothing ignored follows their data.
            while (
                end := position + size_of(data[position + 1 : position + 3], _NEVER)
            ) <= available and data[end - 1] == terminator:
                if data[position] in no_axes:
                    break
                if garbage < position:
                    append(Garbage(data[garbage:position]))
                event = new(CommandReceived)
                event.raw = data[position:end]
                event.decoder = decode
                append(event)
                garbage = position = end
            kind, end = rule.begins(data, position)
            if kind is Garbage:
                self._in_garbage = end == MORE
                position = available if end == MORE else end
                continue
            if end == MORE:
                break
            if garbage < position:
                append(Garbage(data[garbage:position]))
            if kind is CommandReceived:
                append(CommandReceived(data[position:end], decode))
            else:
                append(kind(data[position:end]))
            garbage = position = end
        if garbage < position:
            append(Garbage(data[garbage:position]))
        self._pending = data[position:]
        return events

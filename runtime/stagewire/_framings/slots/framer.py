"""The framer of commands: bytes in, events out. :mod:`stagewire._framings.slots` states the rule."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from stagewire._codec.events import Event, Garbage, fed
from stagewire._framings.slots.command import MAXIMUM_COMMAND, SLOTS, Marks
from stagewire._framings.slots.frame import (
    BadCommandLength,
    CommandFrame,
    CommandReceived,
    UnknownCommand,
)

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Final


MORE: Final = -1
"""Stands for the end of an incomplete event."""


class Request:
    """The facts of one command that framing needs.

    :param name: name of the command, for people.
    :param length: bytes of data that the host sends with it.
    :param size: the number in the size slot if the slot is sent.
    """

    __slots__ = ("length", "name", "size")

    def __init__(self, name: str, length: int, size: int) -> None:
        self.name = name
        self.length = length
        self.size = size


class Rule:
    """The rule of one protocol by which a stream is cut.

    :param marks: the bytes with a fixed meaning.
    :param requests: command byte -> the facts of the command.

    Raises :class:`ValueError` for a command that no stream can hold.
    """

    __slots__ = ("_end", "marks", "requests", "usual")

    def __init__(self, marks: Marks, requests: Mapping[int, Request]) -> None:
        end = marks.terminator
        for byte, request in requests.items():
            if not 0 <= byte <= 0xFF or byte == end:
                raise ValueError(f"{request.name}: a command cannot have the byte {byte:#04x}")
            if not 0 <= request.size <= 0xFF or request.size == end:
                raise ValueError(f"{request.name}: a size slot cannot hold {request.size}")
            if request.length not in (0, request.size):
                raise ValueError(
                    f"{request.name}: {request.length} bytes of data do not match the size {request.size}"
                )
        self.marks = marks
        self.requests = dict(requests)
        self._end = bytes((end,))
        self.usual: dict[bytes, int] = {}
        """Command byte and size slot -> bytes of the whole command without ignored bytes."""
        for byte, request in requests.items():
            self.usual[bytes((byte, request.size))] = SLOTS + request.length + 1
            if not request.length:
                self.usual[bytes((byte, end))] = SLOTS

    def find_end(self, data: bytes, start: int) -> int:
        """Return the position after the first terminator at or after ``start``, or :data:`MORE`."""
        return data.find(self._end, start) + 1 or MORE

    def begins(self, data: bytes, start: int) -> tuple[type[Event], int]:
        """Return the kind of event that begins at ``start``, where a command is expected, and its end.

        If the deciding bytes are missing, the end is :data:`MORE`; if the kind is also undecided, it is
        :class:`~stagewire.framing.Event`. Garbage with the end :data:`MORE` extends to the end of ``data``
        and on to the next terminator.
        """
        marks = self.marks
        end = marks.terminator
        available = len(data) - start
        if not available:
            return Event, MORE
        if data[start] == end:
            return Garbage, start + 1
        if available < 2:
            return Event, MORE
        byte = data[start + 1]
        if data[start] == marks.prefix:
            if byte in marks.setup:
                return CommandReceived, start + 2
            return Garbage, self.find_end(data, start + 1)
        if byte == end:
            return Garbage, start + 2
        kind: type[Event] = UnknownCommand
        rest = start + 2
        request = self.requests.get(byte)
        if request is not None:
            if available < SLOTS:
                return Event, MORE
            size = data[start + 2]
            rest = start + SLOTS
            kind = BadCommandLength
            if size == end:
                return (kind if request.length else CommandReceived), rest
            if size == request.size:
                kind = CommandReceived
                rest += request.length
        limit = start + MAXIMUM_COMMAND
        found = data.find(self._end, rest, limit)
        if found >= 0:
            return kind, found + 1
        if len(data) < limit:
            return kind, MORE
        return Garbage, self.find_end(data, limit)


_NEVER: Final = 1 << 62  # larger than any command


class CommandFramer:
    """A framer that cuts the bytes from a host into events, as a controller reads them.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. No input makes
    it raise.

    :param rule: the rule of the protocol.
    :param decode: returns a frame for the bytes of one command, for ``event.frame``.
    """

    __slots__ = ("_decode", "_in_garbage", "_pending", "_rule")

    def __init__(self, rule: Rule, decode: Callable[[bytes], CommandFrame]) -> None:
        self._rule = rule
        self._decode = decode
        self.reset()

    def reset(self) -> None:
        """Discard pending bytes and expect a command, as at the beginning of a stream."""
        self._pending = b""
        self._in_garbage = False

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more: the beginning of a command."""
        return self._pending

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return the events that they complete.

        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data`` is not bytes.
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
        position = garbage = 0  # returned up to `garbage`, then garbage up to `position`
        if self._in_garbage:
            end = rule.find_end(data, 0)
            position = available if end == MORE else end
            self._in_garbage = end == MORE
        while position < available:
            # Fast path for commands without ignored bytes, which are most of a stream.
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

"""The rule: what begins with given bytes. It is stated in :mod:`stagewire.commands`."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire.commands.events import BadCommandLength, CommandReceived, UnknownCommand
from stagewire.commands.marks import Marks
from stagewire.framing.events import Event, Garbage

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["MAXIMUM_COMMAND", "MORE", "SLOTS", "Request", "Rule"]

SLOTS: Final = 3
"""Slots before the data: axis, command byte, size."""
MAXIMUM_COMMAND: Final = SLOTS + 0xFF + 1
"""Bytes of the longest command: a size slot cannot count further, and the terminator follows."""
MORE: Final = -1
"""The end of what is not all there yet."""


class Request:
    """What framing has to know of one command.

    :param name: for people.
    :param length: bytes of data that the host sends with it.
    :param size: the number in the size slot when the slot is there.
    """

    __slots__ = ("length", "name", "size")

    def __init__(self, name: str, length: int, size: int) -> None:
        self.name = name
        self.length = length
        self.size = size


class Rule:
    """What begins with given bytes, for one protocol.

    :param marks: the bytes that mean something by themselves.
    :param requests: command byte -> what framing has to know of the command.

    Raises :class:`ValueError` for a command that no stream can carry.
    """

    __slots__ = ("_end", "marks", "requests", "usual")

    def __init__(self, marks: Marks, requests: Mapping[int, Request]) -> None:
        end = marks.terminator
        for byte, request in requests.items():
            if not 0 <= byte <= 0xFF or byte == end:
                raise ValueError(f"{request.name}: no command has the byte {byte:#04x}")
            if not 0 <= request.size <= 0xFF or request.size == end:
                raise ValueError(f"{request.name}: no size slot holds {request.size}")
            if request.length not in (0, request.size):
                raise ValueError(
                    f"{request.name}: {request.length} bytes of data cannot go with the size {request.size}"
                )
        self.marks = marks
        self.requests = dict(requests)
        self._end = bytes((end,))
        self.usual: dict[bytes, int] = {}
        """Command byte and size slot -> bytes of the whole command when nothing ignored follows."""
        for byte, request in requests.items():
            self.usual[bytes((byte, request.size))] = SLOTS + request.length + 1
            if not request.length:
                self.usual[bytes((byte, end))] = SLOTS

    def find_end(self, data: bytes, start: int) -> int:
        """Return the position behind the first terminator from ``start`` on, or :data:`MORE`."""
        return data.find(self._end, start) + 1 or MORE

    def begins(self, data: bytes, start: int) -> tuple[type[Event], int]:
        """Return what begins at ``start``, where a command is due, and the position behind it.

        Without the bytes that decide, the position is :data:`MORE`, and the kind is
        :class:`~stagewire.framing.events.Event` if that is open, too. The end of garbage is not
        waited for: with :data:`MORE` it reaches to the end of ``data`` and on to the next terminator.
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

"""The framer of packets: bytes in, events out. :mod:`stagewire._framings.packet` states the rule.

The class of a payload depends on the id of its packet, and then on its length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from stagewire._codec.events import Event, Garbage, fed
from stagewire._framings.packet.packet import (
    BadPacketLength,
    Packet,
    PacketMessage,
    PacketReceived,
    UnknownPacket,
)
from stagewire._framings.packet.shape import Shape


class Layouts:
    """The layouts of one message id.

    :param name: name of the message.
    """

    __slots__ = ("_by_length", "name")

    def __init__(self, name: str) -> None:
        self.name = name
        self._by_length: list[tuple[int, type[PacketMessage]]] = []  # the longest first

    def add(self, cls: type[PacketMessage]) -> None:
        """Add a class; raise :class:`ValueError` if another class has the same length."""
        length = cls.layout.length
        if length in dict(self._by_length):
            raise ValueError(f"{self.name} has two layouts of {length} bytes")
        self._by_length.append((length, cls))
        self._by_length.sort(key=lambda entry: -entry[0])

    def of(self, length: int) -> type[PacketMessage] | None:
        """Return the class of a payload of ``length`` bytes: the longest layout that it fills.

        A message without payload matches only an empty payload; it never has extra bytes.
        """
        for size, cls in self._by_length:
            if size <= length:
                return cls if size or not length else None
        return None

    def lengths(self) -> str:
        """Return the possible lengths of a payload, for people."""
        return " or ".join(str(size) for size, _ in reversed(self._by_length))


def layouts_by_id(shape: Shape, classes: Iterable[type[PacketMessage]]) -> dict[int, Layouts]:
    """Return the layouts of each message by its id.

    Raises :class:`ValueError` for classes that packets of this shape cannot hold or cannot distinguish.
    """
    known: dict[int, Layouts] = {}
    for cls in classes:
        layout = cls.layout
        if not 0 <= layout.id < 1 << 8 * shape.id:
            raise ValueError(f"{layout.message}: the id {layout.id:#x} does not fit into a packet")
        if layout.length > shape.maximum:
            raise ValueError(
                f"{layout.message}: a payload has at most {shape.maximum} bytes, not {layout.length}"
            )
        layouts = known.setdefault(layout.id, Layouts(layout.message))
        if layouts.name != layout.message:
            raise ValueError(
                f"{layout.message} and {layouts.name} have the same id {layout.id:#04x}"
            )
        layouts.add(cls)
    return known


class PacketFramer:
    """A framer that cuts one stream into events, for either end of the line.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. No input makes
    it raise.

    :param shape: the shape of the packets.
    :param layouts: id -> the layouts of its message.
    :param decode: returns a packet for its bytes, for ``event.packet``.
    """

    __slots__ = ("_buffer", "_decode", "_layouts", "_needed", "_shape")

    def __init__(
        self,
        shape: Shape,
        layouts: Mapping[int, Layouts],
        decode: Callable[[bytes], Packet],
    ) -> None:
        self._shape = shape
        self._layouts = layouts
        self._decode = decode
        self.reset()

    def reset(self) -> None:
        """Discard pending bytes, as at the beginning of a stream."""
        self._buffer = bytearray()
        self._needed = 1  # bytes required for the next decision

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more: the beginning of a packet."""
        return bytes(self._buffer)

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return the events that they complete.

        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data`` is not bytes.
        """
        self._buffer += fed(data)
        return self._cut(waits=True) if len(self._buffer) >= self._needed else []

    def abandon(self) -> list[Event]:
        """Give up waiting for the rest of a packet. Afterwards nothing is pending.

        The session calls this after a silence in which the rest would have arrived. The length may be
        damaged, so whole packets after the start bytes are returned; everything else is garbage.
        """
        return self._cut(waits=False)

    def _cut(self, waits: bool) -> list[Event]:
        """Cut events from the front of the buffer. Wait for an incomplete packet, or make it garbage."""
        shape, start = self._shape, self._shape.start
        data = bytes(self._buffer)
        available = len(data)
        events: list[Event] = []
        position = garbage = 0  # returned up to `garbage`, then garbage up to `position`
        needed = 1
        while True:
            position = data.find(start, position)
            if position < 0:
                position = available - (_begun(data, start, garbage) if waits else 0)
                needed = available - position + 1
                break
            size = self._size(data, position)
            if available - position < size:
                if waits:
                    needed = size
                    break
                size = 0
            packet = data[position : position + size]
            if not size or not shape.is_whole(packet):
                position += 1
                continue
            if garbage < position:
                events.append(Garbage(data[garbage:position]))
            events.append(self._event(packet))
            garbage = position = position + size
        if garbage < position:
            events.append(Garbage(data[garbage:position]))
        self._buffer = bytearray(data[position:])
        self._needed = needed
        return events

    def _size(self, data: bytes, start: int) -> int:
        """Return the size of the packet that begins at ``start``, 0 if its length is invalid.

        If its length has not arrived, return the size of the part up to the end of the length.
        """
        shape = self._shape
        if len(data) - start < shape.head:
            return shape.head
        payload = shape.declared(data, start) - shape.counted
        return shape.least + payload if 0 <= payload <= shape.maximum else 0

    def _event(self, packet: bytes) -> Event:
        layouts = self._layouts.get(self._shape.number("id", packet))
        if layouts is None:
            return UnknownPacket(packet)
        if layouts.of(len(packet) - self._shape.least) is None:
            return BadPacketLength(packet)
        return PacketReceived(packet, self._decode)


def _begun(data: bytes, start: bytes, garbage: int) -> int:
    """Return how many bytes at the end of ``data`` may be the beginning of the start bytes."""
    room = min(len(start) - 1, len(data) - garbage)
    return next((size for size in range(room, 0, -1) if data.endswith(start[:size])), 0)

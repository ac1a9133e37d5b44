"""The C parser of packets, called from Python: blocks in, events out."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import NamedTuple

from packet_shapes import Made

from stagewire.framing import (
    BadPacketLength,
    Event,
    Garbage,
    PacketFramer,
    PacketReceived,
    UnknownPacket,
)

_KINDS = ("none", "message", "unknown", "bad_length", "garbage")
_CLASSES = {
    PacketReceived: "message",
    UnknownPacket: "unknown",
    BadPacketLength: "bad_length",
    Garbage: "garbage",
}
_ROOM = 4096  # large enough for all parsers of these tests
_MARK = b"\xa5"


class Seen(NamedTuple):
    """An event: its kind and its bytes."""

    kind: str
    raw: bytes


class _Event(ctypes.Structure):
    _fields_ = (
        ("kind", ctypes.c_int), ("bytes", ctypes.POINTER(ctypes.c_uint8)), ("size", ctypes.c_size_t)
    )  # fmt: skip

    @property
    def seen(self) -> Seen:
        return Seen(_KINDS[self.kind], ctypes.string_at(self.bytes, self.size))


class Parser:
    """A parser in C; checks that it does not write past its memory."""

    def __init__(self, made: Made) -> None:
        self._call = lambda name: getattr(made.library, f"{made.package.prefix}_parser_{name}")
        self._state = ctypes.create_string_buffer(_MARK * _ROOM)
        self._next, self._abandon = self._call("next"), self._call("abandon")
        pending = self._call("pending")
        pending.restype = ctypes.POINTER(ctypes.c_uint8)
        self._pending = pending
        self._call("init")(self._state)

    def feed(self, data: bytes) -> Iterator[Seen]:
        """Feed a block, and yield its events."""
        block = ctypes.create_string_buffer(data, max(1, len(data)))
        first = ctypes.addressof(block)
        at, left, event = ctypes.c_void_p(first), ctypes.c_size_t(len(data)), _Event()
        while self._next(self._state, ctypes.byref(at), ctypes.byref(left), ctypes.byref(event)):
            yield event.seen
        assert (event.kind, left.value, at.value) == (0, 0, first + len(data))
        assert self._state.raw[-64:-1] == _MARK * 63

    def abandon(self) -> Iterator[Seen]:
        """Abandon pending bytes, and yield the events."""
        event = _Event()
        while self._abandon(self._state, ctypes.byref(event)):
            yield event.seen
        assert self.pending == b""

    @property
    def pending(self) -> bytes:
        """The pending bytes."""
        size = ctypes.c_size_t()
        return ctypes.string_at(self._pending(self._state, ctypes.byref(size)), size.value)


class PythonParser:
    """The Python framer with the same interface."""

    def __init__(self, made: Made) -> None:
        self._framer: PacketFramer = made.protocol.framer()

    def feed(self, data: bytes) -> list[Seen]:
        """Feed a block, and return its events."""
        return _seen(self._framer.feed(data))

    def abandon(self) -> list[Seen]:
        """Abandon pending bytes, and return the events."""
        return _seen(self._framer.abandon())

    @property
    def pending(self) -> bytes:
        """The pending bytes."""
        return self._framer.pending


def _seen(events: list[Event]) -> list[Seen]:
    return [Seen(_CLASSES[type(event)], event.raw) for event in events]


def joined(events: list[Seen]) -> list[Seen]:
    """Return events with adjacent garbage joined."""
    found: list[Seen] = []
    for kind, raw in events:
        if kind == "garbage" and found and found[-1].kind == kind:
            raw = found.pop().raw + raw
        found.append(Seen(kind, raw))
    return found

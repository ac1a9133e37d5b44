"""The parser of commands and the reader of replies in C, called from Python."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

_KINDS = ("none", "message", "unknown", "bad_length", "garbage")
_ROOM = 1024  # larger than both


class Event(NamedTuple):
    """An event of a parser or a reader of replies."""

    kind: str
    raw: bytes


class _Event(ctypes.Structure):
    _fields_ = (
        ("kind", ctypes.c_int),
        ("bytes", ctypes.POINTER(ctypes.c_uint8)),
        ("size", ctypes.c_size_t),
    )


class Reader:
    """The parser of commands.

    :param function: finds a function of the library by its name.
    :param kind: the prefix of its functions.
    """

    def __init__(self, function: Callable[[str], Any], kind: str) -> None:
        self.function = function
        self.kind = kind
        self.state = ctypes.create_string_buffer(b"\xa5" * _ROOM)
        self.call("init", self.state)

    def call(self, name: str, *arguments: Any) -> Any:
        """Call one of its functions."""
        return self.function(f"{self.kind}_{name}")(*arguments)

    def next(self, data: bytes) -> tuple[Event | None, bytes]:
        """Return the next event and the unconsumed bytes."""
        buffer = ctypes.create_string_buffer(data, len(data)) if data else None
        at = ctypes.cast(buffer, ctypes.POINTER(ctypes.c_uint8))
        size = ctypes.c_size_t(len(data))
        event = _Event()
        self.call("next", self.state, ctypes.byref(at), ctypes.byref(size), ctypes.byref(event))
        return _made(event), data[len(data) - size.value :]

    def feed(self, data: bytes) -> list[Event]:
        """Return the events of some bytes, all of which are consumed."""
        events = []
        while True:
            event, data = self.next(data)
            if event is None:
                assert data == b""
                return events
            events.append(event)

    @property
    def pending(self) -> bytes:
        """The pending bytes."""
        size = ctypes.c_size_t()
        function = self.function(f"{self.kind}_pending")
        function.restype = ctypes.c_void_p
        return ctypes.string_at(function(self.state, ctypes.byref(size)), size.value)


class Replies(Reader):
    """The reader of replies.

    :param statuses: number of a status -> its name.
    """

    def __init__(self, function: Callable[[str], Any], statuses: Mapping[int, str]) -> None:
        super().__init__(function, "replies")
        self.statuses = statuses

    def sent(self, raw: bytes) -> str:
        """Register a command; return the status."""
        return self.statuses[self.call("sent", self.state, raw, ctypes.c_size_t(len(raw)))]

    def abandon(self) -> list[Event]:
        """Stop waiting; return the bytes received."""
        event = _Event()
        self.call("abandon", self.state, ctypes.byref(event))
        found = _made(event)
        return [found] if found else []

    def drained(self) -> None:
        """Report that the line was silent."""
        self.call("drained", self.state)

    def asks(self, question: str) -> bool:
        """Return whether it is ``outstanding`` or ``poisoned``."""
        function = self.function(f"{self.kind}_{question}")
        function.restype = ctypes.c_bool
        return bool(function(self.state))


def _made(event: _Event) -> Event | None:
    """Return an event of C as an event of Python."""
    if not event.kind:
        return None
    return Event(_KINDS[event.kind], ctypes.string_at(event.bytes, event.size))

"""Received messages, and their descriptions in one line."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

from stagewire.errors import CodecError
from stagewire.framing import (
    BadLength,
    DecodableEvent,
    Event,
    FrameEvent,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    UnknownSubMessage,
)
from stagewire.protocols import HEADER_SIZE, Frame, Message, UndecidedMessage, UndocumentedMessage

_KINDS: Final[dict[type[Event], str]] = {
    Received: "message",
    Undocumented: "undocumented",
    Unknown: "unknown",
    UnknownSubMessage: "unknown",
    BadLength: "bad_length",
    Garbage: "garbage",
}
_MOST: Final = 24  # bytes shown of a received text that is not a message


class Incoming:
    """A received message, or other received bytes.

    :param time: arrival of the last byte, in seconds since the line was opened.
    :param event: the event of the framer.
    :param after: the name of the message that these bytes follow immediately; empty if there is none.
    """

    def __init__(self, time: float, event: Event, after: str = "") -> None:
        self.time = time
        self.event = event
        self.after = after
        self.kind: str = _KINDS[type(event)]
        """``message``, ``undocumented``, ``unknown`` (id or sub-message), ``bad_length`` or ``garbage``."""

    @property
    def raw(self) -> bytes:
        """The received bytes."""
        return self.event.raw

    @cached_property
    def frame(self) -> Frame | None:
        """The decoded frame; None if this is not a known message."""
        if not isinstance(self.event, DecodableEvent):
            return None
        try:
            return self.event.frame
        except CodecError:  # an id without a layout, in an invalid form
            return None

    @property
    def message(self) -> Any:
        """The message, with its fields as attributes; None if this is not a known message."""
        return None if self.frame is None else self.frame.message

    @property
    def name(self) -> str:
        """The name of the message; empty if this is not a known message."""
        return "" if self.frame is None else self.frame.message.layout.message

    @property
    def dest(self) -> int | None:
        """The destination, without the packet flag; None if this is not a frame."""
        return self.event.dest if isinstance(self.event, FrameEvent) else None

    @property
    def source(self) -> int | None:
        """The source; None if this is not a frame."""
        return self.event.source if isinstance(self.event, FrameEvent) else None

    @property
    def channel(self) -> int | None:
        """The value of its channel field; None without one."""
        return getattr(self.message, "chan_ident", None)

    @property
    def extra(self) -> bytes:
        """Bytes beyond the layout."""
        return b"" if self.frame is None else self.frame.extra

    @property
    def payload(self) -> int:
        """The number of bytes after the header; 0 if this is not a frame."""
        return max(0, len(self.raw) - HEADER_SIZE) if isinstance(self.event, FrameEvent) else 0

    @cached_property
    def text(self) -> str:
        """A description in one line."""
        if self.frame is not None:
            return frame_text(self.frame)
        shown = self.raw[:_MOST].hex(" ") + (" …" if len(self.raw) > _MOST else "")
        return f"{self.kind.replace('_', ' ')}: {shown}"

    def __repr__(self) -> str:
        return f"<Incoming at {self.time:.3f} s: {self.text}>"


def frame_text(frame: Frame) -> str:
    """Return a frame in one line: addresses, message and fields."""
    extra = f" extra={frame.extra.hex()}" if frame.extra else ""
    return f"{addressed_text(frame.message, frame.dest, frame.source)}{extra}"


def addressed_text(message: Message, dest: int, source: int) -> str:
    """Return a message with its addresses in one line."""
    return f"{source:#04x}->{dest:#04x} {message_text(message)}"


def message_text(message: Message) -> str:
    """Return a message in one line, without empty reserved fields."""
    layout = message.layout
    name = layout.message
    if isinstance(message, (UndecidedMessage, UndocumentedMessage)):
        return f"{name} {(message.data or b'').hex()}".rstrip()
    words = [
        f"{field}={_shown(value)}"
        for field, value in message.values().items()
        if value or field not in layout.optional
    ]
    return " ".join([name, *words])


def _shown(value: int | str | bytes) -> str:
    """Return a field value as text: integers as they are, strings in quotes, bytes in hex."""
    if isinstance(value, bytes):
        return value.hex()
    return repr(value) if isinstance(value, str) else f"{value:d}"

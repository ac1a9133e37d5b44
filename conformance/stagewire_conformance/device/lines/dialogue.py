"""What came from a controller, event by event, and what is said of it in one line."""

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
)
from stagewire.protocols import HEADER_SIZE, Frame, Message, UndecidedMessage, UndocumentedMessage

_KINDS: Final[dict[type[Event], str]] = {
    Received: "message",
    Undocumented: "undocumented",
    Unknown: "unknown",
    BadLength: "bad_length",
    Garbage: "garbage",
}
_MOST: Final = 24  # bytes of what is no message that are shown


class Incoming:
    """Something that came.

    :param time: when its last byte was there, in seconds since the line was opened.
    :param event: what the framer made of it.
    """

    def __init__(self, time: float, event: Event) -> None:
        self.time = time
        self.event = event
        self.kind: str = _KINDS[type(event)]
        """``message``, ``undocumented``, ``unknown`` (an id that is none), ``bad_length`` or ``garbage``."""

    @property
    def raw(self) -> bytes:
        """Its bytes."""
        return self.event.raw

    @cached_property
    def frame(self) -> Frame | None:
        """The decoded frame; None for what is not a known message."""
        if not isinstance(self.event, DecodableEvent):
            return None
        try:
            return self.event.frame
        except CodecError:  # an id without a layout, in a form that it cannot have
            return None

    @property
    def message(self) -> Any:
        """The message, with its fields as attributes; None for what is not a known one."""
        return None if self.frame is None else self.frame.message

    @property
    def name(self) -> str:
        """The name of the message; empty for what is not a known one."""
        return "" if self.frame is None else self.frame.message.layout.message

    @property
    def dest(self) -> int | None:
        """To whom it goes, without the bit that announces a packet; None for what is no frame."""
        return self.event.dest if isinstance(self.event, FrameEvent) else None

    @property
    def source(self) -> int | None:
        """From whom it comes; None for what is no frame."""
        return self.event.source if isinstance(self.event, FrameEvent) else None

    @property
    def channel(self) -> int | None:
        """The channel that it names; None: it names none."""
        return getattr(self.message, "chan_ident", None)

    @property
    def extra(self) -> bytes:
        """Bytes beyond the layout."""
        return b"" if self.frame is None else self.frame.extra

    @property
    def payload(self) -> int:
        """How many bytes follow the header; 0 for what is no frame."""
        return max(0, len(self.raw) - HEADER_SIZE) if isinstance(self.event, FrameEvent) else 0

    @cached_property
    def text(self) -> str:
        """What it says, in one line."""
        if self.frame is not None:
            return frame_text(self.frame)
        shown = self.raw[:_MOST].hex(" ") + (" …" if len(self.raw) > _MOST else "")
        return f"{self.kind.replace('_', ' ')}: {shown}"

    def __repr__(self) -> str:
        return f"<Incoming at {self.time:.3f} s: {self.text}>"


def frame_text(frame: Frame) -> str:
    """Return a frame in one line: who to whom, the message, and its fields."""
    extra = f" extra={frame.extra.hex()}" if frame.extra else ""
    return f"{frame.source:#04x}->{frame.dest:#04x} {message_text(frame.message)}{extra}"


def message_text(message: Message) -> str:
    """Return a message in one line; what is reserved is left out where it is empty."""
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
    """Return a value of a field: integers as they are, texts in quotes, bytes in hex."""
    if isinstance(value, bytes):
        return value.hex()
    return repr(value) if isinstance(value, str) else f"{value:d}"

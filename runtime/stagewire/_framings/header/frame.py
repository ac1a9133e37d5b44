"""Frames: a message, its destination and source, and any bytes beyond its layout."""

from __future__ import annotations

from collections.abc import Callable

from stagewire._codec.events import Event, Frozen
from stagewire._framings.header.counted import CountedMessage
from stagewire._framings.header.message import (
    DATA_FLAG,
    HEADER_SIZE,
    MAXIMUM_PACKET,
    FramedMessage,
    check_addresses,
)
from stagewire.errors import BadValueError, OutOfRangeError, UnsupportedError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, Final


class Frame(Frozen):
    """A message with its two addresses; immutable.

    :param message: the message.
    :param dest: address of the receiver, without the top bit that announces a data packet.
    :param source: address of the sender.
    :param extra: bytes of the packet beyond the layout, as newer controllers send them.
    """

    __slots__ = ("dest", "extra", "message", "source")
    __match_args__ = ("message", "dest", "source", "extra")
    message: FramedMessage
    dest: int
    source: int
    extra: bytes

    def __new__(cls, message: FramedMessage, dest: int, source: int, extra: bytes = b"") -> Frame:
        """Make a frame.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid address, and
        :class:`~stagewire.errors.BadValueError` for an argument of the wrong type or for extra bytes with a
        message that has no data layout.
        """
        if not isinstance(message, FramedMessage):
            raise BadValueError(f"a frame carries a message, not {message!r}")
        check_addresses(dest, source)
        if extra.__class__ is not bytes:
            if not isinstance(extra, (bytes, bytearray, memoryview)):
                raise BadValueError(f"extra must be bytes, not {extra!r}")
            extra = bytes(extra)
        if extra and isinstance(message, CountedMessage):
            name = message.counted.name
            raise BadValueError(
                f"{message.layout.message} ends with {name}; extra bytes cannot follow"
            )
        if extra and not message.layout.length:
            raise BadValueError(f"{message.layout.message} has no packet to add extra bytes to")
        return make_frame(message, dest, source, extra)

    def encode(self) -> bytes:
        """Return the bytes of the frame.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a packet of over 255 bytes.
        """
        raw = self.message.pack(self.dest, self.source)
        if not self.extra:
            return raw
        length = len(raw) - HEADER_SIZE + len(self.extra)
        if length > MAXIMUM_PACKET:
            raise OutOfRangeError(f"a packet has at most {MAXIMUM_PACKET} bytes, not {length}")
        return raw[:2] + length.to_bytes(2, "little") + raw[4:] + self.extra

    def _key(self) -> tuple[FramedMessage, int, int, bytes]:
        return self.message, self.dest, self.source, self.extra

    def __reduce__(self) -> tuple[Any, ...]:
        return make_frame, self._key()

    def __repr__(self) -> str:
        extra = f", extra={self.extra!r}" if self.extra else ""
        return f"Frame({self.message!r}, dest={self.dest:#04x}, source={self.source:#04x}{extra})"


class _Draft(Frozen):
    """A frame while it is being filled; :mod:`stagewire._codec.events` explains why."""

    __slots__ = Frame.__slots__
    __setattr__ = object.__setattr__
    __delattr__ = object.__delattr__
    message: FramedMessage
    dest: int
    source: int
    extra: bytes


def make_frame(message: FramedMessage, dest: int, source: int, extra: bytes = b"") -> Frame:
    """Return a frame of parts that are known to be valid."""
    draft: Any = _Draft()
    draft.message = message
    draft.dest = dest
    draft.source = source
    draft.extra = extra
    draft.__class__ = Frame
    frame: Frame = draft
    return frame


class FrameEvent(Event):
    """An event whose bytes are one whole frame, as long as its header declares."""

    __slots__ = ()

    payload_offset: Final = HEADER_SIZE  # where the packet begins, if any

    @property
    def id(self) -> int:
        """The message id."""
        return self.raw[0] | self.raw[1] << 8

    @property
    def dest(self) -> int:
        """Address of the receiver, without the bit that announces a packet."""
        return self.raw[4] & ~DATA_FLAG

    @property
    def source(self) -> int:
        """Address of the sender."""
        return self.raw[5]


def no_protocol(raw: bytes) -> Frame:
    """Raise an error; the decoder of a framer without a protocol."""
    raise UnsupportedError("this event's framer has no protocol; use Protocol.framer")


class DecodableEvent(FrameEvent):
    """A frame that is decoded on demand."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], Frame]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], Frame] = no_protocol) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def frame(self) -> Frame:
        """The decoded frame, by the context that the framer had for its source on arrival.

        Raises :class:`~stagewire.errors.UnsupportedError` if the framer has no protocol; ``Protocol.framer``
        returns a framer that has one.
        """
        return self.decoder(self.raw)


class Received(DecodableEvent):
    """A message with a known layout, perhaps with extra bytes."""

    __slots__ = ()


class Undocumented(DecodableEvent):
    """A frame with a known id but no documented layout."""

    __slots__ = ()


class Unknown(FrameEvent):
    """A frame with an unknown id, skipped by its length."""

    __slots__ = ()


class UnknownSubMessage(Unknown):
    """A frame with a known id but an unknown sub-message, skipped by its length."""

    __slots__ = ()

    @property
    def sub_message(self) -> int:
        """The sub-message."""
        at = HEADER_SIZE if len(self.raw) > HEADER_SIZE else 2
        return int.from_bytes(self.raw[at : at + (2 if at == HEADER_SIZE else 1)], "little")


class BadLength(FrameEvent):
    """A frame of a known message whose packet is shorter than every layout."""

    __slots__ = ()

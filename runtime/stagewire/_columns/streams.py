"""Streams of mixed frames, sorted by layout to make columns."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from stagewire._codec.events import Event, Garbage
from stagewire._codec.message import Message
from stagewire._columns.arrays import Buffer, Column, bytes_of, columns, numpy_columns
from stagewire._columns.shape import shape_of
from stagewire._framings.header.frame import Received
from stagewire._framings.header.message import DATA_FLAG, with_flag
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End
from stagewire.errors import UnsupportedError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BLOCK: Final = 8 * 1024
"""Bytes framed at a time; so few events are alive that no garbage collection starts."""


class Frames:
    """The frames of one message class, back to back, in the order received.

    :param message: the message class; its layout must be documented.

    ``raw`` holds the bytes and ``offsets`` the position of each frame in the stream. Frames from newer
    controllers may be longer than their layout. ``raw`` then holds them cut to the layout, with the length
    adjusted, and ``extra`` maps the number of the frame to the bytes that were cut off.
    """

    __slots__ = ("extra", "message", "offsets", "raw", "shape")

    def __init__(self, message: type[Message]) -> None:
        self.message = message
        self.shape = shape_of(message)
        self.clear()

    def clear(self) -> None:
        """Remove all frames."""
        self.raw = bytearray()
        self.offsets = array("Q")
        self.extra: dict[int, bytes] = {}

    def append(self, offset: int, raw: bytes) -> None:
        """Add a frame of this class from position ``offset``, without checking it."""
        shape = self.shape
        if len(raw) != shape.size and shape.counted is None:
            self.extra[len(self.offsets)] = raw[shape.size :]
            raw = shape.head + raw[len(shape.head) : shape.size]
        self.raw += raw
        self.offsets.append(offset)

    def __len__(self) -> int:
        return len(self.offsets)

    def columns(self) -> dict[str, Column]:
        """Return the columns, like :func:`stagewire.columns.columns`."""
        return columns(self.message, self.raw)

    def numpy_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns, like :func:`stagewire.columns.numpy_columns`."""
        return numpy_columns(self.message, self.raw)


class Sorter:
    """A sorter of events that groups the frames of a stream by layout.

    :param protocol: the protocol of the stream.
    :param context: selects between layouts that bytes alone cannot distinguish, such as
        ``{"status": "dc"}``. Without it these frames are stored under their ``…Undecided`` class.
    :param only: the message classes to keep; others are only counted. The default keeps all.

    ``frames`` holds the frames by class, ``counts`` the number of events by kind: messages, undocumented and
    unknown frames, bad lengths, and runs of garbage. Only the frames that are kept take up memory. A
    packet that was received without the data flag is kept with it.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol whose messages have no header.
    """

    def __init__(
        self,
        protocol: FramedProtocol,
        context: Mapping[str, str] | None = None,
        only: Collection[type[Message]] | None = None,
    ) -> None:
        if not isinstance(protocol, FramedProtocol):
            raise UnsupportedError(f"{protocol!r} has no frames to sort into columns")
        self.frames: dict[type[Message], Frames] = {}
        self.counts: dict[type[Event], int] = {}
        self._protocol = protocol
        self._context = context
        self._only = only
        self._in_garbage = False
        # The id of a header form, or the id and length of a data form -> the frames of its class.
        self._known: dict[bytes, Frames | None] = {}

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Take consecutive events, the first of them at position ``offset``."""
        known, received = self._known, 0
        for event in events:
            raw = event.raw
            if event.__class__ is Received:
                received += 1
                key = raw[:4] if raw[4] & DATA_FLAG else raw[:2]
                try:
                    frames = known[key]
                except KeyError:
                    raw = with_flag(raw)
                    frames = self._look_up(raw)
                if frames is not None:
                    frames.append(offset, raw)
                self._in_garbage = False
            else:
                self._count(event)
            offset += len(raw)
        if received:
            self.counts[Received] = self.counts.get(Received, 0) + received

    def _look_up(self, raw: bytes) -> Frames | None:
        """Return the frames of a class, and remember them unless other messages begin alike."""
        key = raw[:4] if raw[4] & DATA_FLAG else raw[:2]
        if raw[0] | raw[1] << 8 in self._protocol.framing.shared:
            key += raw[6:8] if raw[4] & DATA_FLAG else raw[2:3]
        if key not in self._known:
            self._known[key] = self._frames_of(raw)
        return self._known[key]

    def _frames_of(self, raw: bytes) -> Frames | None:
        message = type(self._protocol.decode(raw, self._context).message)
        if self._only is not None and message not in self._only:
            return None
        return self.frames.setdefault(message, Frames(message))

    def _count(self, event: Event) -> None:
        kind = type(event)
        # A run of garbage is cut at the end of each chunk; count it once.
        if kind is not Garbage or not self._in_garbage:
            self.counts[kind] = self.counts.get(kind, 0) + 1
        self._in_garbage = kind is Garbage


class Gatherer(Sorter):
    """A :class:`Sorter` with its own framer, for bytes in chunks of any size.

    :param end: the end of the line that received the stream.

    ``read`` counts the bytes fed.
    """

    def __init__(
        self,
        protocol: FramedProtocol,
        end: End = End.NONE,
        context: Mapping[str, str] | None = None,
        only: Collection[type[Message]] | None = None,
    ) -> None:
        super().__init__(protocol, context, only)
        self.read = 0
        self._framer = protocol.framer(end)

    @property
    def pending(self) -> bytes:
        """The bytes at the end of the stream that are not a whole frame yet."""
        return self._framer.pending

    def feed(self, data: Buffer) -> None:
        """Take the next bytes of the stream.

        Raises :class:`~stagewire.errors.BadValueError` if ``data`` is not bytes.
        """
        with bytes_of(data) as view:
            for start in range(0, len(view), _BLOCK):
                block = bytes(view[start : start + _BLOCK])
                offset = self.read - len(self._framer.pending)
                self.take(offset, self._framer.feed(block))
                self.read += len(block)


def gather(
    protocol: FramedProtocol,
    chunks: Iterable[Buffer],
    end: End = End.NONE,
    context: Mapping[str, str] | None = None,
    only: Collection[type[Message]] | None = None,
) -> Gatherer:
    """Sort the frames of a whole stream; see :class:`Sorter` and :class:`Gatherer`.

    Raises the same errors.
    """
    gatherer = Gatherer(protocol, end, context, only)
    for chunk in chunks:
        gatherer.feed(chunk)
    return gatherer

"""A stream of all kinds of frames, sorted by layout: what columns are made of."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from stagewire._codec.events import Event, Garbage
from stagewire._codec.message import Message
from stagewire._columns.arrays import Buffer, Column, bytes_of, columns, numpy_columns
from stagewire._columns.shape import shape_of
from stagewire._framings.header.frame import Received
from stagewire._framings.header.message import DATA_FLAG
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End
from stagewire.errors import UnsupportedError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BLOCK: Final = 8 * 1024
"""Bytes that are framed at once; so few events live together that no garbage collection starts."""


class Frames:
    """Frames of one message class, back to back in the order in which they came.

    :param message: the class; one with a documented layout.

    ``raw`` holds the bytes, ``offsets`` where each frame stood in its stream. Frames of a stream may
    be longer than their layout, as newer controllers send them: ``raw`` has them cut to the layout,
    with the length that it says, and ``extra`` what followed, by the number of the frame.
    """

    __slots__ = ("extra", "message", "offsets", "raw", "shape")

    def __init__(self, message: type[Message]) -> None:
        self.message = message
        self.shape = shape_of(message)
        self.clear()

    def clear(self) -> None:
        """Forget all frames."""
        self.raw = bytearray()
        self.offsets = array("Q")
        self.extra: dict[int, bytes] = {}

    def append(self, offset: int, raw: bytes) -> None:
        """Add one frame of this class, which stood at ``offset``; it is not checked here."""
        shape = self.shape
        if len(raw) != shape.size:
            self.extra[len(self.offsets)] = raw[shape.size :]
            raw = shape.head + raw[len(shape.head) : shape.size]
        self.raw += raw
        self.offsets.append(offset)

    def __len__(self) -> int:
        return len(self.offsets)

    def columns(self) -> dict[str, Column]:
        """Return the columns, as :func:`stagewire.columns.columns` does."""
        return columns(self.message, self.raw)

    def numpy_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns, as :func:`stagewire.columns.numpy_columns` does."""
        return numpy_columns(self.message, self.raw)


class Sorter:
    """Takes the events of a stream and keeps the frames of every layout apart.

    :param protocol: whose stream it is.
    :param context: what decides between layouts that bytes cannot tell apart, such as
        ``{"status": "dc"}``; without it those frames come under their ``…Undecided`` class.
    :param only: the message classes that are kept; all of them by default. Others are counted.

    ``frames`` has the frames by class, ``counts`` how many events of each kind came: messages,
    undocumented and unknown frames, bad lengths, and runs of garbage. Memory grows with the frames
    that are kept, and with nothing else.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol whose messages have no header.
    """

    def __init__(
        self,
        protocol: FramedProtocol,
        context: Mapping[str, str] | None = None,
        only: Collection[type[Message]] | None = None,
    ) -> None:
        if not isinstance(protocol, FramedProtocol):
            raise UnsupportedError(f"{protocol!r} has no frames that could be sorted into columns")
        self.frames: dict[type[Message], Frames] = {}
        self.counts: dict[type[Event], int] = {}
        self._protocol = protocol
        self._context = context
        self._only = only
        self._in_garbage = False
        # The id of a header form, id and length of a data form -> where its frames go.
        self._known: dict[bytes, Frames | None] = {}

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Take events that follow one another, the first of which stands at ``offset``."""
        known, received = self._known, 0
        for event in events:
            raw = event.raw
            if event.__class__ is Received:
                received += 1
                key = raw[:4] if raw[4] & DATA_FLAG else raw[:2]
                try:
                    frames = known[key]
                except KeyError:
                    frames = known[key] = self._frames_of(raw)
                if frames is not None:
                    frames.append(offset, raw)
                self._in_garbage = False
            else:
                self._count(event)
            offset += len(raw)
        if received:
            self.counts[Received] = self.counts.get(Received, 0) + received

    def _frames_of(self, raw: bytes) -> Frames | None:
        message = type(self._protocol.decode(raw, self._context).message)
        if self._only is not None and message not in self._only:
            return None
        return self.frames.setdefault(message, Frames(message))

    def _count(self, event: Event) -> None:
        kind = type(event)
        # a run of garbage is cut where a chunk ends: it is counted once
        if kind is not Garbage or not self._in_garbage:
            self.counts[kind] = self.counts.get(kind, 0) + 1
        self._in_garbage = kind is Garbage


class Gatherer(Sorter):
    """Takes the bytes of a stream in any chunks: a :class:`Sorter` with a framer of its own.

    :param end: which end of the line received the stream.

    ``read`` counts the bytes that were fed.
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
        """The bytes at the end of what was fed that are no whole frame."""
        return self._framer.pending

    def feed(self, data: Buffer) -> None:
        """Take the next bytes of the stream.

        Raises :class:`~stagewire.errors.BadValueError` for what is not bytes.
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
    """Return the frames of a whole stream, sorted; see :class:`Sorter` and :class:`Gatherer`.

    Raises as they do.
    """
    gatherer = Gatherer(protocol, end, context, only)
    for chunk in chunks:
        gatherer.feed(chunk)
    return gatherer

"""The framer: bytes in, events out. The rule is stated in :mod:`stagewire.framing`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from stagewire.errors import BadValueError
from stagewire.frame import Frame
from stagewire.framing.events import (
    DecodableEvent,
    Event,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    fed,
    join_garbage,
    no_protocol,
)
from stagewire.framing.rule import TooLong, rule_of
from stagewire.framing.table import End, FramingTable
from stagewire.header import HEADER_SIZE

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["Framer"]

Decode = Callable[..., Frame]
"""Makes a frame of its bytes and, if given, of the context that decides between layouts."""

_NEVER: Final = 1 << 62  # the size of a frame that no buffer will ever hold
_REMEMBERED_HEADERS: Final = 1024


class Framer:
    """Cuts one stream into events, for the end of the line that it sits on.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    Nothing that comes from outside makes it raise.

    :param table: what framing has to know of the protocol.
    :param end: which end receives here; a framer that knows it recovers sooner.
    :param decode: makes a frame of bytes and the context of their source, for ``event.frame``.

    Raises :class:`~stagewire.errors.BadValueError` for an end that is none.
    """

    __slots__ = (
        "_contexts", "_decode", "_decoder", "_in_step", "_needed", "_pending", "_rule", "_sizes"
    )  # fmt: skip

    def __init__(
        self, table: FramingTable, end: End = End.NONE, decode: Decode | None = None
    ) -> None:
        if not isinstance(end, End):
            raise BadValueError(
                f"the end of a line is one of {', '.join(map(str, End))}, not {end!r}"
            )
        self._rule = rule_of(table, end)
        self._decode = decode
        self._decoder: Callable[[bytes], Frame] = decode or no_protocol
        self._contexts: dict[int, dict[str, str]] = {}
        # Headers that were messages in step -> size of their frame: a controller says the same few
        # things again and again. No more than _REMEMBERED_HEADERS, whatever comes.
        self._sizes: dict[bytes, int] = {}
        self.reset()

    def reset(self) -> None:
        """Forget what is pending and be in step, as at the beginning of a stream."""
        self._pending = b""
        self._needed = HEADER_SIZE
        self._in_step = True

    def tell(self, source: int, **context: str) -> None:
        """Say once what decides between layouts of messages from ``source``.

        ``framer.tell(0x22, status="dc")``: ``event.frame`` of messages that come from 0x22 from then
        on has the DC status, where without it the layout stays undecided. What was told before of
        this source is replaced. Raises :class:`~stagewire.errors.BadValueError` for a source that is no
        address.
        """
        if isinstance(source, bool) or not isinstance(source, int) or not 0 <= source <= 0xFF:
            raise BadValueError(f"a source is an address from 0 to 0xff, not {source!r}")
        if self._decode:
            self._contexts = {**self._contexts, source: context}
            self._decoder = _in_context(self._decode, self._contexts)

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more to come: the beginning of a frame."""
        return self._pending

    def abandon(self) -> list[Event]:
        """Give up waiting: the frame that is pending is garbage, and nothing is pending any more.

        The session calls this after a silence in which the rest of a frame would have come. Whole
        frames behind a header that was damaged are given out (rule 6). The framer is out of step,
        unless such a frame was the last that came.
        """
        events: list[Event] = []
        while pending := self._pending:
            given_up = len(pending) if self._waits_for_unknown() else 1
            events.append(Garbage(pending[:given_up]))
            self._pending = b""
            self._needed = HEADER_SIZE
            self._in_step = False
            events += self.feed(pending[given_up:])
        return join_garbage(events)

    def begins_message(self, data: bytes) -> bool:
        """Say whether ``data`` begins with a header that is accepted out of step (rule 5)."""
        return len(data) >= HEADER_SIZE and bool(self._rule.out_of_step(data[:HEADER_SIZE]))

    def _waits_for_unknown(self) -> bool:
        if not self._in_step or len(self._pending) < HEADER_SIZE:
            return False
        kind, _ = self._rule.in_step(self._pending[:HEADER_SIZE])
        return kind in (Unknown, Undocumented)

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return what they complete.

        The events of a chunk live together: large captures are framed fastest in chunks of a few KiB.
        Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
        """
        data = fed(data)
        if self._pending:
            data = self._pending + data
        available = len(data)
        if available < self._needed:
            self._pending = data
            return []

        events: list[Event] = []
        append, new, size_of = events.append, object.__new__, self._sizes.get
        decoder = self._decoder
        position = 0  # everything before it has been given out, or is garbage since `garbage`
        garbage = 0
        in_step = self._in_step
        while True:
            if in_step:
                # Headers seen before. A part of a header is never among them.
                while (
                    end := position + size_of(data[position : position + HEADER_SIZE], _NEVER)
                ) <= available:
                    event = new(Received)
                    event.raw = data[position:end]
                    event.decoder = decoder
                    append(event)
                    position = end
                garbage = position
            if available - position < HEADER_SIZE:
                needed = HEADER_SIZE
                break
            if in_step:
                header = data[position : position + HEADER_SIZE]
                kind, size = self._rule.in_step(header)
                if available - position < size:
                    needed = size
                    break
                if kind is TooLong:
                    _, found = self._rule.find(data, position + 1, position + size)
                    kind, size = (Garbage, 1) if found else (Received, size)
                elif kind is Received and len(self._sizes) < _REMEMBERED_HEADERS:
                    self._sizes[header] = size
                if kind is Garbage:
                    in_step = False
                elif issubclass(kind, DecodableEvent):
                    append(kind(data[position : position + size], decoder))
                else:
                    append(kind(data[position : position + size]))
                position += size
            else:
                position, size = self._rule.find(data, position, available)
                if not size or available - position < size:
                    needed = size or HEADER_SIZE
                    break
                if garbage < position:
                    append(Garbage(data[garbage:position]))
                append(Received(data[position : position + size], decoder))
                position += size
                in_step = True

        if garbage < position:
            append(Garbage(data[garbage:position]))
        self._pending = data[position:]
        self._needed = needed
        self._in_step = in_step
        return events


def _in_context(
    decode: Decode, contexts: Mapping[int, Mapping[str, str]]
) -> Callable[[bytes], Frame]:
    """Return a decoder by the context of the source, which is byte 5 of a frame."""
    return lambda raw: decode(raw, contexts.get(raw[5]))

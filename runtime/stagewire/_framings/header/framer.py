"""The framer: bytes in, events out. :mod:`stagewire._framings.header` explains the rule."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from struct import Struct

from stagewire._codec.events import Event, Garbage, fed, join_garbage
from stagewire._codec.message import Direction
from stagewire._framings.header.frame import (
    BadLength,
    DecodableEvent,
    Frame,
    FrameEvent,
    Received,
    Undocumented,
    Unknown,
    UnknownSubMessage,
    no_protocol,
)
from stagewire._framings.header.message import DATA_FLAG, HEADER_SIZE, MAXIMUM_PACKET
from stagewire._framings.header.table import (
    SUB_MESSAGE_SIZE,
    End,
    Forms,
    FramingTable,
    sub_message_of,
)
from stagewire.errors import BadValueError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from re import Pattern
    from typing import Final


_HEADER: Final = Struct("<HHBB")  # id, parameters or packet length, destination, source


class TooLong(FrameEvent):
    """A packet with room for a header after its layout; internal, resolved before events are returned."""

    __slots__ = ()


class WrongCount(FrameEvent):
    """A packet whose fields state another length; internal, resolved before events are returned."""

    __slots__ = ()


class InPacket(FrameEvent):
    """A packet whose content decides what it is; internal, resolved before events are returned."""

    __slots__ = ()


_DOUBTFUL: Final[Mapping[type[Event], type[Event]]] = {TooLong: Received, WrongCount: BadLength}
# The kinds whose length may be damaged -> what they are if their packet contains no header of ours.


class _Shape:
    """The forms of one id of ours, with the addresses that are right for it."""

    __slots__ = (
        "counted", "header", "lengths", "longest", "only_zero", "right", "sub_messages"
    )  # fmt: skip

    def __init__(self, forms: Forms, right: frozenset[int]) -> None:
        self.header = forms.header
        self.lengths = forms.lengths
        self.counted = forms.counted
        self.longest = forms.counted.most if forms.counted else MAXIMUM_PACKET
        self.only_zero = forms.only_zero_parameters
        self.right = right
        self.sub_messages: dict[int | None, _Shape] = {
            value: _Shape(known, right) for value, known in forms.sub_messages.items()
        }

    def has_header_form(self, parameters: int) -> bool:
        """Whether the header form allows these two parameter bytes, read as one word."""
        if self.has_length(parameters) or (self.only_zero and parameters):
            return False
        return self.header

    def has_length(self, length: int) -> bool:
        """Whether a packet may have this length, without extra bytes."""
        return length in self.lengths or (self.counted is not None and self.counted.admits(length))

    def layout_length(self, length: int) -> int | None:
        """Return the longest layout that a packet of ``length`` bytes fills, if any."""
        return max((known for known in self.lengths if known <= length), default=None)


class Rule:
    """The meaning of a header, for one table and one end. Immutable after construction.

    A pair of addresses is stored as one number: destination (without its top bit) times 256, plus source.
    """

    def __init__(self, table: FramingTable, end: End) -> None:
        host, devices = table.host, table.devices
        to_host = frozenset(host << 8 | device for device in devices)
        to_controller = frozenset(device << 8 | host for device in devices)

        def right(direction: Direction) -> frozenset[int]:
            pairs: frozenset[int] = frozenset()
            if Direction.TO_HOST in direction:
                pairs |= to_host
            if Direction.TO_CONTROLLER in direction:
                pairs |= to_controller
            return pairs

        self.right = right(end.receives)
        self.tolerated = to_host | to_controller | {0}
        self.has_packet = table.has_packet
        self.shapes: dict[int, _Shape] = {}
        self.undocumented: set[int] = set()
        self.not_ours: set[int] = set()
        for id, forms in table.forms.items():
            ours = forms.direction & end.receives
            if not forms.documented:
                self.undocumented.add(id)
            elif ours:
                self.shapes[id] = _Shape(forms, right(ours))
            else:
                self.not_ours.add(id)
        self._sieve = self._make_sieve()

    def _make_sieve(self) -> Pattern[bytes]:
        """Return a pattern that matches all headers accepted out of step and little else."""
        import re  # only needed to frame a stream

        destinations = {pair >> 8 for pair in self.tolerated}
        destinations |= {destination | DATA_FLAG for destination in destinations}
        sources = {pair & 0xFF for pair in self.tolerated}
        low, high = {id & 0xFF for id in self.shapes}, {id >> 8 for id in self.shapes}
        if not self.shapes:
            return re.compile(b"(?!)")
        one_of = [b"[" + b"".join(b"\\x%02x" % byte for byte in sorted(bytes_)) + b"]"
                  for bytes_ in (low, high, destinations, sources)]  # fmt: skip
        return re.compile(b"%b%b..%b%b" % tuple(one_of), re.DOTALL)

    def in_step(self, header: bytes) -> tuple[type[Event], int]:
        """Return the kind and size of the event that begins with ``header``, in step."""
        id, word, dest, source = _HEADER.unpack(header)
        has_packet = self.has_packet(header)
        shape = self.shapes.get(id)
        if has_packet and word > (MAXIMUM_PACKET if shape is None else shape.longest):
            return Garbage, 1
        size = HEADER_SIZE + word if has_packet else HEADER_SIZE
        addresses = (dest & ~DATA_FLAG) << 8 | source
        if shape is None:
            if id in self.not_ours or addresses not in self.right:
                return Garbage, 1
            return (Undocumented if id in self.undocumented else Unknown), size
        if addresses not in self.tolerated:
            return Garbage, 1
        if shape.sub_messages:
            return self._shared(shape, header, word, addresses, has_packet)
        if not has_packet:
            return (Received, size) if shape.has_header_form(word) else (Garbage, 1)
        if shape.counted is not None:
            return (BadLength if word < shape.counted.least else InPacket), size
        return _packet(shape, word)

    def _shared(
        self, shape: _Shape, header: bytes, word: int, addresses: int, has_packet: bool
    ) -> tuple[type[Event], int]:
        """Return the kind and size of the event that begins with the header of a shared id, in step."""
        if has_packet:
            if shape.lengths and word >= SUB_MESSAGE_SIZE:
                return InPacket, HEADER_SIZE + word
            return _packet(shape, word)
        if not shape.has_header_form(word):
            return Garbage, 1
        known = shape.sub_messages.get(header[2])
        if known is None:
            right = addresses in shape.right
            return (UnknownSubMessage, HEADER_SIZE) if right else (Garbage, 1)
        return (Received, HEADER_SIZE) if known.has_header_form(word) else (Garbage, 1)

    def by_packet(self, frame: bytes) -> tuple[type[Event], int]:
        """Return the kind and size of the event for a whole frame that is ``InPacket`` by its header."""
        id, word, dest, source = _HEADER.unpack_from(frame)
        shape = self.shapes[id]
        if shape.counted is not None:
            return (Received if shape.counted.length_in(frame) == word else WrongCount), len(frame)
        known = shape.sub_messages.get(sub_message_of(frame))
        if known is not None:
            return _packet(known, word)
        right = (dest & ~DATA_FLAG) << 8 | source in shape.right
        return (UnknownSubMessage, len(frame)) if right else (Garbage, 1)

    def is_sure(self, frame: bytes) -> bool:
        """Whether a whole frame that is accepted out of step by its header is a message."""
        shape = self.shapes[frame[0] | frame[1] << 8]
        if shape.counted is not None and frame[4] & DATA_FLAG:
            return shape.counted.length_in(frame) == len(frame) - HEADER_SIZE
        if not shape.sub_messages or len(frame) == HEADER_SIZE:
            return True
        known = shape.sub_messages.get(sub_message_of(frame))
        return known is not None and len(frame) - HEADER_SIZE in known.lengths

    def out_of_step(self, header: bytes) -> int:
        """Return the size of the frame that ``header`` begins, 0 if it is not accepted out of step."""
        id, word, dest, source = _HEADER.unpack(header)
        shape = self.shapes.get(id)
        if shape is None:
            return 0
        addresses = (dest & ~DATA_FLAG) << 8 | source
        if self.has_packet(header):
            exact = shape.has_length(word) and addresses in self.tolerated
            return HEADER_SIZE + word if exact else 0
        known = shape.sub_messages.get(word & 0xFF) if shape.sub_messages else shape
        has_form = shape.has_header_form(word) and known is not None and known.has_header_form(word)
        return HEADER_SIZE if has_form and addresses in shape.right else 0

    def find(self, data: bytes, start: int, stop: int) -> tuple[int, int]:
        """Return the position of the first header accepted out of step, and the size of its frame.

        The whole header is between ``start`` and ``stop``. If none is found, the size is 0 and the position
        is the first that has no whole header after it.
        """
        while (candidate := self._sieve.search(data, start, stop)) is not None:
            start = candidate.start()
            size = self.out_of_step(data[start : start + HEADER_SIZE])
            if size:
                return start, size
            start += 1
        return max(start, stop - HEADER_SIZE + 1), 0


def _packet(shape: _Shape, length: int) -> tuple[type[Event], int]:
    """Return the kind and size of a packet with a header of ours, in step."""
    if not shape.lengths:
        return Garbage, 1
    layout, size = shape.layout_length(length), HEADER_SIZE + length
    if layout is None:
        return BadLength, size
    return (Received if length - layout < HEADER_SIZE else TooLong), size


@cache
def rule_of(table: FramingTable, end: End) -> Rule:
    """Return the rule of a table and an end, cached because every session and framer needs it."""
    return Rule(table, end)


Decode = Callable[..., Frame]
"""Decodes the bytes of a frame; the optional context selects between layouts."""

_NEVER: Final = 1 << 62  # larger than any frame
_REMEMBERED_HEADERS: Final = 1024


class Framer:
    """A framer that cuts one stream into events, for one end of the line.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. No input makes
    it raise.

    :param table: the facts of the protocol that framing needs.
    :param end: the end of the line that receives the stream; with it, the framer recovers sooner.
    :param decode: returns a frame for its bytes and the context of their source, for ``event.frame``.

    Raises :class:`~stagewire.errors.BadValueError` if ``end`` is not an :class:`End`.
    """

    __slots__ = (
        "_contexts", "_decode", "_decoder", "_in_step", "_needed", "_pending", "_rule", "_sizes"
    )  # fmt: skip

    def __init__(
        self, table: FramingTable, end: End = End.NONE, decode: Decode | None = None
    ) -> None:
        if not isinstance(end, End):
            raise BadValueError(
                f"the end of a line must be one of {', '.join(map(str, End))}, not {end!r}"
            )
        self._rule = rule_of(table, end)
        self._decode = decode
        self._decoder: Callable[[bytes], Frame] = decode or no_protocol
        self._contexts: dict[int, dict[str, str]] = {}
        # Headers that were messages in step -> size of their frame. Controllers repeat the same few
        # headers. The number of entries is limited to _REMEMBERED_HEADERS.
        self._sizes: dict[bytes, int] = {}
        self.reset()

    def reset(self) -> None:
        """Discard pending bytes and be in step, as at the beginning of a stream."""
        self._pending = b""
        self._needed = HEADER_SIZE
        self._in_step = True

    def tell(self, source: int, **context: str) -> None:
        """Set the context that selects between layouts of messages from ``source``.

        After ``framer.tell(0x22, status="dc")``, ``event.frame`` decodes later messages from 0x22 with the DC
        status; without it their layout stays undecided. A new context replaces the previous one of this
        source. Raises :class:`~stagewire.errors.BadValueError` if ``source`` is not an address.
        """
        if isinstance(source, bool) or not isinstance(source, int) or not 0 <= source <= 0xFF:
            raise BadValueError(f"source must be an address from 0 to 0xff, not {source!r}")
        if self._decode:
            self._contexts = {**self._contexts, source: context}
            self._decoder = _in_context(self._decode, self._contexts)

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more: the beginning of a frame."""
        return self._pending

    def abandon(self) -> list[Event]:
        """Give up waiting for the rest of a frame. Afterwards nothing is pending.

        The session calls this after a silence in which the rest would have arrived. Return the whole frames
        after a damaged header (rule 6), and everything else as garbage. The framer is then out of step,
        unless such a frame was the last event.
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
        """Return whether ``data`` begins with a header that is accepted out of step (rule 5)."""
        return len(data) >= HEADER_SIZE and bool(self._rule.out_of_step(data[:HEADER_SIZE]))

    def _waits_for_unknown(self) -> bool:
        if not self._in_step or len(self._pending) < HEADER_SIZE:
            return False
        kind, _ = self._rule.in_step(self._pending[:HEADER_SIZE])
        return kind in (Unknown, Undocumented)

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return the events that they complete.

        All events of a chunk are in memory together; feed large captures in chunks of a few KiB for the best
        speed. Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data`` is not bytes.
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
        position = 0  # bytes before it are returned; those since `garbage` are garbage
        garbage = 0
        in_step = self._in_step
        while True:
            if in_step:
                # Headers seen before. A partial header is never among them.
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
                if kind is Received and len(self._sizes) < _REMEMBERED_HEADERS:
                    self._sizes[header] = size
                elif kind is InPacket:
                    kind, size = self._rule.by_packet(data[position : position + size])
                if kind in _DOUBTFUL:
                    _, found = self._rule.find(data, position + 1, position + size)
                    kind, size = (Garbage, 1) if found else (_DOUBTFUL[kind], size)
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
                raw = data[position : position + size]
                if not self._rule.is_sure(raw):
                    position += 1
                    continue
                if garbage < position:
                    append(Garbage(data[garbage:position]))
                append(Received(raw, decoder))
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
    """Return a decoder that uses the context of the source, which is byte 5 of a frame."""
    return lambda raw: decode(raw, contexts.get(raw[5]))

"""Properties of the codec and the framer that hold for any bytes.

Each check takes one input: some control bytes, followed by the data to process. It raises
:class:`AssertionError` if a property is broken; any other exception is an undocumented one. The
coverage-guided fuzzer (``atheris_codec.py``) and the seeded tests call the same functions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import cycle
from typing import Any

from command_properties import check_commands
from streams import ARRAYS, LONGEST_PACKET, PROTOCOL, STREAM_CONTROLS, Array, as_sent
from tally import SEEN, Seen, count, count_in

from stagewire.errors import (
    BadLengthError,
    BadValueError,
    CodecError,
    MissingFieldError,
    OutOfRangeError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownSubMessageError,
    UnsupportedError,
)
from stagewire.framing import (
    BadLength,
    End,
    Event,
    Framer,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    join_garbage,
)
from stagewire.protocols import (
    DATA_FLAG,
    HEADER_SIZE,
    MAXIMUM_PACKET,
    Direction,
    Frame,
    Message,
    UndecidedMessage,
    UndocumentedMessage,
)

__all__ = ["SEEN", "check_codec", "check_commands", "check_stream", "count_in"]

MAXIMAL_FRAME = HEADER_SIZE + LONGEST_PACKET
ENDS = (End.HOST, End.DEVICE, End.NONE)
Context = dict[str, str] | None

CONTEXTS: tuple[Context, ...] = (
    None,
    *({key: value} for key, value in sorted({
        item for cls in PROTOCOL.messages for item in cls.layout.when.items()
    })),
    {"status": "no such thing"},
)  # fmt: skip

_TO_HOST = frozenset((PROTOCOL.host, device) for device in PROTOCOL.devices)
_TO_CONTROLLER = frozenset((device, host) for host, device in _TO_HOST)
RIGHT = {
    Direction.TO_HOST: _TO_HOST,
    Direction.TO_CONTROLLER: _TO_CONTROLLER,
    Direction.BOTH: _TO_HOST | _TO_CONTROLLER,
}
_LENGTHS: dict[int, set[int]] = {}
for _cls in PROTOCOL.messages:
    _LENGTHS.setdefault(_cls.layout.id, set()).add(_cls.layout.length)


# The framer

_LIFETIME = 20_000
"""Inputs per framer. Creating one costs more than framing, and its memory of headers must also be tested."""

_framers: dict[tuple[End, int], tuple[Framer, Framer]] = {}
_age = 0


def _two_framers(end: End, context: int) -> tuple[Framer, Framer]:
    """Return two equal framers that have the given context for every source address."""
    global _age
    _age += 1
    if _age > _LIFETIME:
        _framers.clear()
        _age = 0
    key = end, context
    if key not in _framers:
        _framers[key] = PROTOCOL.framer(end), PROTOCOL.framer(end)
        for framer in _framers[key]:
            for source in range(256):
                framer.tell(source, **(CONTEXTS[context] or {}))
    for framer in _framers[key]:
        framer.reset()
    return _framers[key]


def check_stream(data: bytes) -> None:
    """Frame one stream whole, in chunks, and with a frame abandoned partway.

    A failure is repeated with new framers. If it does not occur again, the message says so, because the input
    that is kept cannot reproduce it alone.
    """
    try:
        _check_stream(data)
    except Exception as error:
        _framers.clear()
        try:
            _check_stream(data)
        except Exception:
            raise error from None
        raise AssertionError(
            f"only with a framer that has framed other streams: {error}"
        ) from error


def _check_stream(data: bytes) -> None:
    controls, stream = data[:STREAM_CONTROLS].ljust(STREAM_CONTROLS, b"\0"), data[STREAM_CONTROLS:]
    end = ENDS[controls[0] % 3]
    known = controls[0] // 3 % len(CONTEXTS) if controls[0] & 0x80 else 0
    context = CONTEXTS[known]
    framer, other = _two_framers(end, known)

    events = framer.feed(stream)
    pending = framer.pending
    assert b"".join([event.raw for event in events]) + pending == stream, (
        "bytes were lost or reordered"
    )
    assert len(pending) < MAXIMAL_FRAME, f"{len(pending)} bytes are pending"
    whole = join_garbage(events)
    _check_first(stream, whole, end)
    for event in whole:
        _check_event(event, end, context)

    _check_chunks(stream, _sizes(controls[1], controls[2]), other, whole, pending)
    if controls[3] & 1:
        _check_abandoned(stream, controls[3], framer, end, context)
    else:
        assert framer.abandon() == other.abandon(), "the abandoned bytes depend on the chunks"


def _check_chunks(
    stream: bytes, sizes: Iterator[int], framer: Framer, whole: list[Event], pending: bytes
) -> None:
    """Check that chunks give the same events, and that the framer holds at most one frame and one read."""
    events: list[Event] = []
    position = waiting = 0
    while position < len(stream):
        chunk = stream[position : position + next(sizes)]
        position += len(chunk)
        new = framer.feed(chunk)
        emitted = sum([len(event.raw) for event in new])
        held = waiting + len(chunk)  # all the framer can hold, as no byte is emitted twice
        waiting = len(framer.pending)
        assert emitted + waiting == held, f"{emitted} out, {waiting} pending, {held} in"
        assert waiting < MAXIMAL_FRAME, f"{waiting} bytes are pending"
        events += new
    assert framer.pending == pending, "the pending bytes depend on the chunks"
    assert join_garbage(events) == whole, "the events depend on the chunks"


def _check_abandoned(stream: bytes, where: int, framer: Framer, end: End, context: Context) -> None:
    """Check that abandoning a frame loses no byte, leaves none pending, and lets the framer continue."""
    cut = len(stream) * where // 255
    framer.reset()
    before = framer.feed(stream[:cut])
    count(Seen.PENDING, bool(framer.pending))
    given_up = framer.abandon()
    assert not framer.pending, "bytes are still pending after abandon()"
    count(Seen.ABANDONED, bool(given_up))
    for event in given_up:
        _check_event(event, end, context)
    after = framer.feed(stream[cut:])
    out = b"".join([event.raw for event in (*before, *given_up, *after)])
    assert out + framer.pending == stream, "bytes were lost or reordered after abandon()"


def _sizes(kind: int, size: int) -> Iterator[int]:
    """Return the sizes of chunks, constant or alternating."""
    if kind < 16:
        return cycle((1,))
    if kind < 128:
        return cycle((size % 64 + 1,))
    return cycle((kind % 7 + 1, size % 41 + 1, 1, size % 300 + 1, HEADER_SIZE))


def _declared(raw: bytes) -> int:
    return HEADER_SIZE + (raw[2] | raw[3] << 8 if as_sent(raw)[4] & DATA_FLAG else 0)


def _check_first(stream: bytes, events: list[Event], end: End) -> None:
    """Check that a valid frame at the start of a stream is received unchanged."""
    if len(stream) < HEADER_SIZE:
        return
    raw = stream[: _declared(stream)]
    try:
        frame = PROTOCOL.decode(raw)
    except CodecError:
        return
    layout = frame.message.layout
    receives = layout.direction & end.receives
    if frame.extra or not receives or (frame.dest, frame.source) not in RIGHT[receives]:
        return
    if isinstance(frame.message, UndocumentedMessage):
        assert events[:1] == [Undocumented(raw)], (
            "a valid undocumented frame at the start was not received"
        )
        return
    if len(raw) == HEADER_SIZE and not raw[4] & DATA_FLAG:
        parameters = raw[2] | raw[3] << 8
        lost_its_flag = parameters and parameters in _LENGTHS[layout.id]
        if lost_its_flag or (layout.only_zero and parameters):
            return
    count(Seen.WHOLE_FIRST)
    assert events[:1] == [Received(raw)], "a valid frame at the start was not received"


def _check_event(event: Event, end: End, context: Context) -> None:
    """Check that an event agrees with the codec about its bytes."""
    raw = event.raw
    kind = event.__class__
    assert raw, "an event without bytes"
    if kind is Garbage:
        count(Seen.GARBAGE)
        return
    assert len(raw) == _declared(raw) <= MAXIMAL_FRAME, "an event without exactly one whole frame"
    addresses = raw[4] & ~DATA_FLAG, raw[5]
    unknown = issubclass(kind, Unknown)  # the id, or the sub-message
    if unknown or kind is BadLength:
        expected = UnknownMessageError if unknown else BadLengthError
        count(Seen.UNKNOWN if unknown else Seen.BAD_LENGTH)
        if kind is Unknown:
            assert addresses in RIGHT[end.receives], "an unknown frame for another address"
        try:
            PROTOCOL.decode(raw)
        except expected:
            return
        raise AssertionError(f"{event!r} decodes")
    assert kind is Received or kind is Undocumented, f"an event of kind {kind}"
    frame = event.frame  # type: ignore[attr-defined]
    assert frame.encode() == as_sent(raw), "the frame encodes to other bytes"
    if context:
        assert frame == PROTOCOL.decode(raw, context), (
            "the framer ignored the context of the source"
        )
    message = frame.message
    if kind is Undocumented:  # framed by its addresses, like an unknown frame, not by its direction
        count(Seen.UNDOCUMENTED)
        assert isinstance(message, UndocumentedMessage), "an undocumented message that has a layout"
        assert addresses in RIGHT[end.receives], "an undocumented frame for another address"
    else:
        count(Seen.MESSAGE)
        count(Seen.EXTRA, bool(frame.extra))
        assert message.layout.direction & end.receives, "a message of the other direction"
        assert not isinstance(message, UndocumentedMessage), "a message without a layout"
        assert addresses == (0, 0) or addresses in RIGHT[Direction.BOTH], "foreign addresses"


# The codec

Refusals = tuple[type[CodecError], ...]

DECODE_REFUSALS: Refusals = (
    TruncatedError, TrailingBytesError, BadLengthError, UnknownMessageError,
)  # fmt: skip
BUILD_REFUSALS: Refusals = (
    UnknownMessageError, UnsupportedError, BadLengthError, UnknownFieldError, MissingFieldError,
    OutOfRangeError, BadValueError,
)  # fmt: skip
_REFUSED = {
    TruncatedError: Seen.TRUNCATED,
    TrailingBytesError: Seen.TRAILING,
    BadLengthError: Seen.WRONG_LENGTH,
    UnknownMessageError: Seen.UNKNOWN_MESSAGE,
    UnknownSubMessageError: Seen.UNKNOWN_MESSAGE,
}


def check_codec(data: bytes) -> None:
    """Decode one frame, or build one by name. The first byte chooses which, and the context."""
    if not data:
        return
    if data[0] & 0x80:
        _check_build(_Reader(data[1:]))
    else:
        _check_decode(data[1:], CONTEXTS[data[0] % len(CONTEXTS)])


def _check_decode(raw: bytes, context: Context) -> None:
    try:
        frame = PROTOCOL.decode(raw, context)
    except DECODE_REFUSALS as error:
        count(_REFUSED[error.__class__])
        _check_refused(raw, error)
        return
    count(Seen.DECODED)
    assert frame.encode() == as_sent(raw), "decoding and encoding gave other bytes"
    again = PROTOCOL.decode(memoryview(raw), context)
    assert again == frame, "decoding twice gave unequal frames"
    assert hash(again) == hash(frame), "equal frames have unequal hashes"
    message = frame.message
    assert Frame(message, frame.dest, frame.source, frame.extra) == frame
    assert type(message).keep(message.values()) == message
    _check_rebuilt(message)


def _check_refused(raw: bytes, error: CodecError) -> None:
    """Check that the error names the actual defect, in any context."""
    whole = len(raw) >= HEADER_SIZE
    if isinstance(error, TruncatedError):
        assert not whole or len(raw) < _declared(raw), "TruncatedError for a whole frame"
    elif isinstance(error, TrailingBytesError):
        assert len(raw) > _declared(raw), "TrailingBytesError without trailing bytes"
    elif isinstance(error, UnknownSubMessageError):
        assert raw[0] | raw[1] << 8 in PROTOCOL.framing.shared, "a sub-message of an id without any"
    elif isinstance(error, UnknownMessageError):
        assert raw[0] | raw[1] << 8 not in _LENGTHS, (
            "UnknownMessageError for an id that has a layout"
        )
    else:
        id = raw[0] | raw[1] << 8
        length = _declared(raw) - HEADER_SIZE
        known = _LENGTHS[id]
        if array := ARRAYS.get(id):
            count(Seen.WRONG_COUNT)
            fits = array.least <= length <= array.most
            assert not fits or length != array.stated(raw[HEADER_SIZE:])
            return
        if id in PROTOCOL.framing.shared:  # each sub-message has lengths of its own
            return
        assert length > MAXIMUM_PACKET or length not in known or (not length and raw[4] & DATA_FLAG)


def _check_rebuilt(message: Message) -> None:
    """Check that rebuilding a decoded message from its values gives an equal one, unless out of range."""
    layout = message.layout
    count(Seen.ARRAY, layout.id in ARRAYS)
    values = message.values()
    data = None
    if isinstance(message, (UndecidedMessage, UndocumentedMessage)):
        data = values.pop("data")
        count(Seen.UNDECIDED, isinstance(message, UndecidedMessage))
        if data is not None:
            values.clear()
    try:
        made = PROTOCOL.build(layout.message, values, layout.form, data)
    except OutOfRangeError:
        return
    assert made == message, f"{made!r} was built from the values of {message!r}"


def _check_build(reader: _Reader) -> None:
    """Build a message by name from any values: it is refused with a documented error or round-trips."""
    number = int.from_bytes(reader.take(2), "little")
    cls = PROTOCOL.messages[number % len(PROTOCOL.messages)]
    layout = cls.layout
    name, form = reader.name(layout.message), reader.form(layout.form)
    values = _RIGHT_VALUES[cls]
    fields = {
        field: reader.value(values.get(field)) for field in layout.fields if reader.byte() < 252
    }
    if reader.byte() > 245:
        fields[reader.text()] = reader.value()
    if layout.id in ARRAYS and reader.byte() < 245:
        _fill(reader, ARRAYS[layout.id], fields)
    data = None
    if issubclass(cls, (UndecidedMessage, UndocumentedMessage)) != (reader.byte() > 245):
        data = reader.bytes(layout.length)
        fields = {} if reader.byte() < 200 else fields
    dest, source, extra = reader.address(0x50), reader.address(0x01), reader.extra()
    try:
        message = PROTOCOL.build(name, fields, form, data)
        frame = Frame(message, dest, source, extra)
        raw = frame.encode()
    except BUILD_REFUSALS:
        count(Seen.NOT_BUILT)
        return
    count(Seen.BUILT)
    count(Seen.BUILT_ARRAY, message.layout.id in ARRAYS)
    layout = message.layout
    decoded = PROTOCOL.decode(raw, layout.when or None)
    assert decoded.encode() == raw, "encoding and decoding gave other bytes"
    longest = len(raw) - HEADER_SIZE
    if extra and any(layout.length < other <= longest for other in _LENGTHS[layout.id]):
        return  # with the extra bytes, a longer layout matches
    assert decoded == frame, f"{frame!r} was decoded as {decoded!r}"


def _fill(reader: _Reader, array: Array, fields: dict[str, Any]) -> None:
    """Give an array as many integers as the other fields state, if their values are possible."""
    try:
        number = array.count(fields)
    except (KeyError, TypeError, AttributeError):
        return
    if isinstance(number, int) and 0 <= number < LONGEST_PACKET:
        fields[array.name] = [
            int.from_bytes(reader.take(4), "little", signed=True) for _ in range(number)
        ]


class _Reader:
    """A source of values read from bytes, followed by zeros."""

    __slots__ = ("_at", "_data")

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def byte(self) -> int:
        at = self._at
        self._at = at + 1
        return self._data[at] if at < len(self._data) else 0

    def take(self, size: int) -> bytes:
        at = self._at
        self._at = at + size
        return self._data[at : at + size].ljust(size, b"\0")

    def text(self) -> str:
        return self.take(self.byte() % 20).decode("utf-8", "replace")

    def name(self, right: str) -> str:
        return right if self.byte() < 252 else self.text()

    def form(self, right: str) -> str | None:
        kind = self.byte()
        return right if kind < 240 else None if kind < 252 else self.text()

    def bytes(self, length: int) -> Any:
        kind = self.byte()
        if kind < 180:
            return self.take(length)
        return self.take(2 * self.byte()) if kind < 245 else self.value()

    def address(self, right: int) -> Any:
        kind = self.byte()
        return right if kind < 220 else self.byte() if kind < 245 else self.value()

    def extra(self) -> Any:
        kind = self.byte()
        return b"" if kind < 200 else self.take(self.byte()) if kind < 250 else self.value()

    def value(self, right: Callable[[_Reader], Any] | None = None) -> Any:
        kind = self.byte()
        if right and kind < 240:
            return right(self)
        return _ANY_VALUE[kind % len(_ANY_VALUE)](self)


_ANY_VALUE: tuple[Callable[[_Reader], Any], ...] = (
    lambda reader: reader.byte(),
    lambda reader: int.from_bytes(reader.take(2), "little", signed=True),
    lambda reader: int.from_bytes(reader.take(4), "little"),
    lambda reader: int.from_bytes(reader.take(9), "little", signed=True),
    lambda reader: 1 << reader.byte(),
    lambda reader: -1 << reader.byte(),
    lambda reader: reader.byte() > 127,
    lambda reader: None,
    lambda reader: float(reader.byte()) if reader.byte() < 200 else float("nan"),
    lambda reader: reader.text(),
    lambda reader: "\0" * reader.byte(),
    lambda reader: reader.take(reader.byte() % 70),
    lambda reader: bytearray(reader.take(8)),
    lambda reader: [reader.byte()],
)


def _right_value(field: dict[str, Any]) -> Callable[[_Reader], Any]:
    """Return a function that reads a value of the field, in range except for some texts."""
    size = field["size"]
    if field["kind"] == "text":
        return lambda reader: _text(reader, size)
    if field["kind"] == "bytes":
        return lambda reader: reader.take(size)
    if field["kind"] == "array":
        return lambda reader: list(reader.take(reader.byte() % 20))
    low, span = field["minimum"], field["maximum"] - field["minimum"] + 1
    return lambda reader: low + (int.from_bytes(reader.take(size), "little") - low) % span


def _text(reader: _Reader, size: int) -> str:
    """Return a text that fits, is too long, ends with a NUL, or is not Latin-1."""
    kind = reader.byte()
    text = reader.take(size).decode("latin-1")
    if kind < 160:
        return text.rstrip("\0")
    if kind < 190:
        return text + "x"
    return text[:-1] + "\0" if kind < 220 else reader.text()


def _right_values() -> dict[type[Message], dict[str, Callable[[_Reader], Any]]]:
    fields: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for message in PROTOCOL.registry()["messages"]:
        for layout in message["layouts"]:
            named = [layout[key] for key in ("param1", "param2") if layout[key]]
            fields[message["name"], layout["form"]] = [*named, *layout["fields"]]
    return {
        cls: {
            field["name"]: _right_value(field)
            for field in fields.get((cls.layout.message, cls.layout.form), [])
        }
        for cls in PROTOCOL.messages
    }


_RIGHT_VALUES = _right_values()

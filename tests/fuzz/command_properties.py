"""Properties of commands and replies that hold for any bytes, like those of messages in ``properties.py``."""

from __future__ import annotations

from itertools import cycle, pairwise

from command_streams import COMMAND_CONTROLS
from tally import Seen, count

from stagewire.errors import (
    BadLengthError,
    OutOfRangeError,
    OutstandingReplyError,
    TrailingBytesError,
    TruncatedError,
    UnknownMessageError,
)
from stagewire.framing import (
    BadCommandLength,
    CommandReceived,
    Event,
    Garbage,
    ReplyReceived,
    UnknownCommand,
    join_garbage,
)
from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL

LONGEST = 3 + 255 + 1
REFUSALS = (TruncatedError, TrailingBytesError, BadLengthError, UnknownMessageError)
REQUESTS = tuple(
    CommandFrame(cls(), 0x18)
    for cls in PROTOCOL.messages
    if issubclass(cls, Command) and cls.reply is not None
)


def check_commands(data: bytes) -> None:
    """Read a stream as a controller and as a host, whole and in chunks."""
    controls, stream = (
        data[:COMMAND_CONTROLS].ljust(COMMAND_CONTROLS, b"\0"),
        data[COMMAND_CONTROLS:],
    )
    edges = _edges(len(stream), controls[0], controls[1])
    _check_framer(stream, edges)
    _check_decode(stream)
    _check_replies(stream, edges, controls[2], controls[3])


def _edges(length: int, first: int, second: int) -> list[int]:
    """Return the positions at which the stream is cut."""
    edges = [0]
    sizes = cycle((1,) if first < 16 else (first % 40 + 1, second % 300 + 1, 1))
    while edges[-1] < length:
        edges.append(min(edges[-1] + next(sizes), length))
    return edges


def _check_framer(stream: bytes, edges: list[int]) -> None:
    framer = PROTOCOL.framer()
    events = framer.feed(stream)
    pending = framer.pending
    assert b"".join([event.raw for event in events]) + pending == stream, (
        "bytes were lost or reordered"
    )
    assert len(pending) < LONGEST, f"{len(pending)} bytes are pending"
    count(Seen.COMMAND_PENDING, bool(pending))
    for event in events:
        _check_event(event)

    other = PROTOCOL.framer()
    in_chunks: list[Event] = []
    fed = out = 0
    for start, stop in pairwise(edges):
        new = other.feed(stream[start:stop])
        fed += stop - start
        out += sum([len(event.raw) for event in new])
        assert out + len(other.pending) == fed, "bytes were lost or reordered"
        assert len(other.pending) < LONGEST, f"{len(other.pending)} bytes are pending"
        in_chunks += new
    assert join_garbage(in_chunks) == join_garbage(events), "the events depend on the chunks"
    assert other.pending == pending, "the pending bytes depend on the chunks"


def _check_event(event: Event) -> None:
    """Check that an event agrees with the codec about its bytes."""
    raw = event.raw
    assert raw, "an event without bytes"
    if isinstance(event, CommandReceived):
        _check_frame(event.frame, raw)
    elif isinstance(event, (UnknownCommand, BadCommandLength)):
        unknown = isinstance(event, UnknownCommand)
        count(Seen.UNKNOWN_COMMAND if unknown else Seen.BAD_COMMAND)
        expected = UnknownMessageError if unknown else BadLengthError
        try:
            PROTOCOL.decode(raw)
        except expected:
            return
        raise AssertionError(f"{event!r} decodes")
    else:
        assert type(event) is Garbage, f"an event of kind {type(event)}"
        count(Seen.COMMAND_GARBAGE)
        _check_decode(raw)


def _check_frame(frame: CommandFrame, raw: bytes) -> None:
    """Check that a frame encodes to its bytes, can be rebuilt, and is refused if it holds a setup command."""
    message = frame.message
    layout = message.layout
    count(Seen.SETUP_COMMAND if frame.axis is None else Seen.COMMAND)
    count(Seen.IGNORED_BYTES, bool(frame.extra))
    assert len(raw) <= LONGEST, "the command is too long"
    assert frame.encode(allow_dummy=True) == raw, "the frame encodes to other bytes"
    assert PROTOCOL.decode(memoryview(raw)) == frame, "decoding twice gave unequal frames"
    assert CommandFrame(message, frame.axis, frame.extra, frame.sized) == frame
    assert PROTOCOL.message_class(layout.message, frame.form) is type(message)
    try:
        assert PROTOCOL.build(layout.message, message.values(), frame.form) == message
    except OutOfRangeError:
        count(Seen.OUT_OF_RANGE)
    marks = PROTOCOL.marks
    looks = any(a == marks.prefix and b in marks.setup for a, b in pairwise(raw))
    try:
        assert frame.encode(allow_dummy=True, refuse_prefix_bytes=True) == raw
        assert frame.axis is None or not looks, "a frame that holds a setup command was encoded"
    except OutOfRangeError:
        count(Seen.LOOKS_LIKE_SETUP)
        assert looks, "a frame that holds no setup command was refused"


def _check_decode(raw: bytes) -> None:
    """Check that bytes decode exactly when the framer receives them as one whole command."""
    framer = PROTOCOL.framer()
    events = framer.feed(raw)
    one = [type(event) for event in events] == [CommandReceived] and not framer.pending
    try:
        PROTOCOL.decode(raw)
    except REFUSALS:
        count(Seen.COMMAND_REFUSED)
        assert not one, "a whole command was refused"
    else:
        assert one, "bytes that are not one whole command were decoded"


def _check_replies(stream: bytes, edges: list[int], first: int, silence: int) -> None:
    """Send a request whenever none is outstanding: each reply has the right length, and none is shifted."""
    decoder = PROTOCOL.replies()
    out = b""
    late = False  # whether bytes of an earlier request may still arrive
    for turn, (start, stop) in enumerate(pairwise(edges)):
        request = REQUESTS[(first + turn) % len(REQUESTS)]
        if decoder.outstanding is None:
            try:
                decoder.sent(request)
            except OutstandingReplyError:
                assert late, "a request was refused although no late reply can arrive"
            else:
                assert not late, "a request was accepted while a late reply may arrive"
                assert len(out) == start, "a request was accepted while bytes are pending"
        events = decoder.feed(stream[start:stop])
        count(Seen.LATE_REPLY, late)
        for event in events:
            if isinstance(event, ReplyReceived):
                assert not late, "a late reply was matched to a request"
                count(Seen.REPLY)
                assert event.reply.pack() == event.raw, "the reply packs to other bytes"
                assert PROTOCOL.decode_reply(event.raw, event.request) == event.reply
        late = late or any(isinstance(event, Garbage) for event in events)
        if turn == silence % 16:
            late = late or decoder.outstanding is not None
            events += decoder.abandon()
        elif late and turn % 4 == silence // 16 % 4:
            late = False
            decoder.drained()
        out += b"".join([event.raw for event in events])
        assert out + decoder.pending == stream[:stop], "bytes were lost or reordered"

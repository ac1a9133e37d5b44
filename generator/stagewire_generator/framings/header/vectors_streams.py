"""Streams of frames with headers, complete, cut and damaged, and the events of a framer.

This is a slow and simple implementation of the rule of the library's framer, which also gives the reasons
for it. It examines the header at each position anew, and does not search or remember anything.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from stagewire_generator.framings.header.vectors_frames import (
    ANNOUNCED,
    MOST,
    SIZE,
    data_frame,
    has_array,
    header_frame,
    id_of,
    lengths_of,
    longest,
    stated_length,
    sub_message_of,
    undocumented_frames,
    unknown_id,
    unknown_sub_messages,
    with_high_length,
    without_flag,
)
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.targets.vectors.framing import (
    Framing,
    Piece,
    Scenario,
    in_bytes,
    join_garbage,
    stream_answer,
    stream_case,
)
from stagewire_generator.targets.vectors.subject import Case, Subject
from stagewire_generator.targets.vectors.values import fields_from_bytes, shown

ENDS: Final = {
    "host": frozenset({"to_host"}),
    "device": frozenset({"to_controller"}),
    "none": frozenset({"to_host", "to_controller"}),
}
"""End of the line -> the directions that it receives."""


_DOUBTFUL: Final = {"long": "message", "miscounted": "bad_length"}
# Pieces with a length that may be damaged -> what they are if their packet contains no header of ours.


class HeaderReader:
    """Reads streams for one end of the line."""

    def __init__(self, protocol: Protocol, end: str) -> None:
        host, devices = protocol.framing["host"], protocol.framing["devices"]
        self._pairs = {
            "to_host": {(host, device) for device in devices},
            "to_controller": {(device, host) for device in devices},
        }
        self._tolerated = self._pairs["to_host"] | self._pairs["to_controller"] | {(0, 0)}
        self._receives = ENDS[end]
        self._messages: dict[int | None, list[Message]] = {}
        for message in protocol.messages:
            self._messages.setdefault(message.id, []).append(message)

    def read(self, stream: bytes) -> list[Piece]:
        """Return the pieces of a stream; adjacent garbage is joined."""
        return join_garbage(self._cut(stream))

    def _cut(self, stream: bytes) -> Iterator[Piece]:
        at, in_step = 0, True
        while at < len(stream):
            rest = stream[at:]
            if len(rest) < SIZE:
                yield "pending", rest
                return
            kind, size = self._in_step(rest) if in_step else self._out_of_step(rest)
            if size > len(rest):
                yield "pending", rest
                return
            if kind in _DOUBTFUL:  # the length is damaged if the packet contains a header of ours
                inside = range(1, size - SIZE + 1)
                hit = any(self._by_header(rest[i:])[0] == "message" for i in inside)
                kind, size = ("garbage", 1) if hit else (_DOUBTFUL[kind], size)
            yield kind, rest[:size]
            at, in_step = at + size, kind != "garbage"

    def _in_step(self, rest: bytes) -> tuple[str, int]:
        """Return the kind and the length of the piece at the start, in step."""
        messages, word, announced, pair = self._header(rest)
        garbage = "garbage", 1
        message = messages[0] if messages else None  # those of one id have one direction
        if announced and word > (longest(message) if message else MOST):
            return garbage
        size = SIZE + word if announced else SIZE
        if message is None:
            return ("unknown", size) if pair in self._right(*self._receives) else garbage
        if not message.layouts:
            receives = pair in self._right(*self._receives)
            return ("undocumented", size) if receives else garbage
        if not self._ours(message) or pair not in self._tolerated:
            return garbage
        if not announced and not self._has_header(messages, word):
            return garbage
        lengths = _lengths(messages)
        if message.sub_message is not None and (not announced or (lengths and word >= 2)):
            if size > len(rest):
                return "message", size  # incomplete
            meant = self._meant(messages, rest[:size])
            if not meant:
                right = pair in self._right(*self._ours(message))
                return ("unknown", size) if right else garbage
            messages, lengths = meant, _lengths(meant)
        if not announced:
            return ("message", SIZE) if self._has_header(messages, word) else garbage
        if not lengths:
            return garbage
        if has_array(message):
            if word < min(lengths):
                return "bad_length", size
            whole = rest[SIZE:size]
            wrong = len(rest) >= size and stated_length(message, whole) != word
            return ("miscounted" if wrong else "message"), size
        fitting = [length for length in lengths if length <= word]
        if not fitting:
            return "bad_length", size
        return ("message" if word - max(fitting) < SIZE else "long"), size

    def _out_of_step(self, rest: bytes) -> tuple[str, int]:
        """Return the kind and the length of the piece at the start, out of step."""
        kind, size = self._by_header(rest)
        if kind == "garbage":
            return kind, size
        messages, word, announced, _ = self._header(rest)
        if announced and size <= len(rest):
            meant = self._meant(messages, rest[:size])
            if not _allows(meant, word):
                return "garbage", 1
            packet = rest[SIZE:size]
            if has_array(meant[0]) and stated_length(meant[0], packet) != word:
                return "garbage", 1
        return kind, size

    def _by_header(self, rest: bytes) -> tuple[str, int]:
        """Return the kind and the length of the piece at the start, out of step, by its header alone."""
        if rest[0] | rest[1] << 8 not in self._messages:
            return "garbage", 1
        messages, word, announced, pair = self._header(rest)
        if self._ours(messages[0]):
            if announced and _allows(messages, word) and pair in self._tolerated:
                return "message", SIZE + word
            right = pair in self._right(*self._ours(messages[0]))
            if not announced and right and self._has_header(messages, word):
                meant = self._meant(messages, rest[:SIZE])
                if self._has_header(meant, word):
                    return "message", SIZE
        return "garbage", 1

    def _header(self, rest: bytes) -> tuple[list[Message], int, bool, tuple[int, int]]:
        """Return the messages of a header, its second word, whether it has a packet, and its addresses."""
        messages, word = self._messages.get(rest[0] | rest[1] << 8, []), rest[2] | rest[3] << 8
        announced = bool(rest[4] & ANNOUNCED) or any(
            message.without_flag and word in lengths_of(message) for message in messages
        )
        return messages, word, announced, (rest[4] & ~ANNOUNCED, rest[5])

    def _meant(self, messages: list[Message], raw: bytes) -> list[Message]:
        """Return the message of an id that the sub-message of a whole frame selects, if any."""
        value = sub_message_of(raw)
        return [m for m in messages if m.sub_message in (None, value)]

    def _ours(self, message: Message) -> frozenset[str]:
        """Return the directions of a message that this end receives."""
        both = ("to_host", "to_controller")
        return self._receives & {*(both if message.direction == "both" else (message.direction,))}

    def _right(self, *directions: str) -> set[tuple[int, int]]:
        return set().union(*(self._pairs[direction] for direction in directions))

    def _has_header(self, messages: list[Message], parameters: int) -> bool:
        """Whether a header with these parameters can be a message, not a packet without its data flag."""
        headers = [x for message in messages for x in message.layouts if x.form == "header"]
        if _allows(messages, parameters):
            return False
        return any(not (header.only_zero and parameters) for header in headers)


def _lengths(messages: list[Message]) -> set[int]:
    """Return the lengths of the packets of an id."""
    return {length for message in messages for length in lengths_of(message)}


def _allows(messages: list[Message], length: int) -> bool:
    """Whether a packet of an id may have this length, without extra bytes."""
    for layout in (layout for message in messages for layout in message.layouts):
        if layout.form == "header":
            continue
        more = length - layout.length
        if more == 0 or (
            layout.array
            and more > 0
            and length <= layout.longest
            and more % layout.array.item.size == 0
        ):
            return True
    return False


_DAMAGE = b"\xff"


def layout_stream(readers: Mapping[str, HeaderReader], of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield streams of the plain frame of a layout, at the end that receives it.

    :param readers: the reader of each end of the line.
    """
    end = {"to_host": "host", "to_controller": "device"}.get(of.message.direction, "none")
    context = {"context": dict(of.layout.when)} if of.layout.when else {}
    half = len(raw) // 2
    streams = [("plain", "", [raw[:half], raw[half:]])]
    if of.layout.form != "header":
        about = "a length whose high byte is 1, then a frame"
        streams.append(("length.high", about, [with_high_length(raw) + raw]))
    if of.message.without_flag and of.layout.form != "header":
        bare = without_flag(raw)
        about = "a frame without the data flag, then a frame"
        streams.append(("without_flag", about, [bare[:half], bare[half:] + raw]))
        about = "a byte of garbage, a frame without the data flag, then a frame"
        streams.append(("without_flag.garbage", about, [_DAMAGE + bare + raw]))
        about = "a frame without the data flag and with an unknown sub-message, then a frame"
        unknown = bare[:SIZE] + b"\xff\xff" + bare[SIZE + 2 :]
        streams.append(("without_flag.unknown", about, [unknown + raw]))
    for name, about, chunks in streams:
        pieces = readers[end].read(b"".join(chunks))
        expected = stream_answer(pieces, lambda _: of.answer(of.plain))
        yield of.stream(name, about, chunks, expected, end=end, **context)


def stream_cases(
    framing: Framing, readers: Mapping[str, HeaderReader], subjects: Sequence[Subject]
) -> Iterator[Case]:
    """Yield streams at each end of the line; they begin with a message that this end receives.

    :param readers: the reader of each end of the line.
    """
    protocol = framing.protocol
    decided = [of for of in subjects if not of.layout.when]
    decided.sort(
        key=lambda of: (of.layout.array is not None, not of.layout.length)
    )  # packets first: they can be damaged in more ways
    for end, receives in ENDS.items():
        ours = [of for of in decided if of.message.direction in (*receives, "both")]
        if not ours:
            continue
        decode = _Decoder(protocol, subjects)
        for scenario in _scenarios(framing, ours, decided):
            pieces = readers[end].read(b"".join(scenario[2]))
            if all(decode.can(raw) for kind, raw in pieces if kind == "message"):
                expected = stream_answer(pieces, decode)
                yield stream_case(f"stream/{end}", scenario, expected, end=end)


class _Decoder:
    """Decodes the messages of a stream, without a context."""

    def __init__(self, protocol: Protocol, subjects: Sequence[Subject]) -> None:
        self._subjects: dict[int, list[Subject]] = {}
        for of in subjects:
            self._subjects.setdefault(id_of(of.message), []).append(of)
        self._undocumented = {
            raw: says
            for message in protocol.messages
            if message.id is not None and not message.layouts
            for raw, (_, _, says) in undocumented_frames(protocol, message).items()
        }

    def can(self, raw: bytes) -> bool:
        """Whether the bytes of a message decide on its layout."""
        return not self._layout(raw).layout.when

    def __call__(self, raw: bytes) -> Json:
        """Return the answer of a decoder to a frame."""
        if raw in self._undocumented:
            return self._undocumented[raw]
        of = self._layout(raw)
        header = of.layout.form == "header"
        content = raw[2:4] if header else raw[SIZE:]
        values = fields_from_bytes(of.fields, content)
        says = {
            **of.says,
            "dest": raw[4] & ~ANNOUNCED,
            "source": raw[5],
            "fields": shown(of.fields, values),
        }
        extra = b"" if header or of.layout.array else content[of.layout.length :]
        return {**says, "extra": extra.hex()} if extra else says

    def _layout(self, raw: bytes) -> Subject:
        """Return the longest layout that the packet fills, or the layout without a packet."""
        forms = self._subjects[raw[0] | raw[1] << 8]
        forms = [of for of in forms if of.message.sub_message in (None, sub_message_of(raw))]
        if len(raw) == SIZE and not raw[4] & ANNOUNCED:
            return next(of for of in forms if of.layout.form == "header")
        packets = [of for of in forms if of.layout.form != "header"]
        fitting = [of for of in packets if of.layout.length <= len(raw) - SIZE]
        return max(fitting, key=lambda of: of.layout.length)


def _scenarios(
    framing: Framing, ours: Sequence[Subject], every: Sequence[Subject]
) -> Iterator[Scenario]:
    lead = ours[0]
    raw = framing.frame(lead, lead.plain.held)
    yield from _sub_messages(framing.protocol, ours, raw)
    for of in ours:
        if of.layout.array:
            yield from _arrays(of, framing.frame(of, of.plain.held), raw)
    other = next((of for of in every if of.message.direction != lead.message.direction), lead)
    yield "nothing", "no chunks", []
    yield "empty", "chunks without bytes", [b"", b""]
    yield "bytes", "one byte at a time", in_bytes(raw + raw)
    back = framing.frame(other, other.plain.held)
    yield "both_ways", "a message of the other direction between two frames", [raw + back + raw]
    astray = back[:4] + bytes((back[4] & ANNOUNCED | raw[4] & ~ANNOUNCED, raw[5])) + back[SIZE:]
    about = "a message of the other direction with addresses of this one, then a frame"
    yield "astray", about, [astray + raw]
    yield "pending", "an incomplete second frame", [raw + raw[:-1]]
    yield "pending.header", "an incomplete second header", [raw, raw[: SIZE - 1]]
    yield "garbage.first", "a byte of garbage, then a frame", [_DAMAGE + raw]
    yield "garbage.between", "garbage between two frames", [raw + 3 * _DAMAGE + raw]
    yield "garbage.alone", "only garbage", [12 * _DAMAGE]
    yield "lost.first", "a frame without its first byte, then two frames", [raw[1:] + raw + raw]
    yield "lost.last", "a frame without its last byte, then two frames", [raw[:-1] + raw + raw]
    yield from _addressed(framing.protocol, raw)
    yield from _unknown(framing.protocol, lead, raw)
    if lead.layout.length:
        yield from _packets(framing, lead, raw)
    headers = [of for of in ours if of.layout.form == "header"]
    if headers:
        yield from _headers(framing, lead, headers)


def _sub_messages(protocol: Protocol, ours: Sequence[Subject], raw: bytes) -> Iterator[Scenario]:
    """Yield frames of unknown sub-messages, and packets too short for one."""
    seen = set()
    for of in ours:
        id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
        if of.message.sub_message is None or id in seen:
            continue
        seen.add(id)
        unknown = unknown_sub_messages(protocol, of.message, dest, source)
        for name, (about, frame) in unknown.items():
            yield f"{of.message.name}.unknown.{name}", f"{about}, then a frame", [frame + raw]
            about = f"garbage, {about}, then a frame"
            yield f"{of.message.name}.garbage.{name}", about, [_DAMAGE + frame + raw]
        for length in (0, 1):
            short = data_frame(id, bytes(length), dest, source)
            about = f"a packet of {length} bytes, without a sub-message, then a frame"
            yield f"{of.message.name}.short.{length}", about, [short + raw]


def _arrays(of: Subject, array: bytes, raw: bytes) -> Iterator[Scenario]:
    """Yield frames whose length is not the one that their fields state, and long ones."""
    id, dest, source, name = (
        id_of(of.message),
        of.asked["dest"],
        of.asked["source"],
        of.message.name,
    )
    layout, packet = of.layout, array[SIZE:]
    assert layout.array is not None
    size, last = layout.array.item.size, layout.length - 1
    yield f"{name}.bytes", "a frame with an array, one byte at a time", in_bytes(array + raw)
    yield f"{name}.garbage", "garbage, a frame with an array, then a frame", [_DAMAGE + array + raw]
    for ending, about, wrong in (
        ("short", "a packet shorter than its fields", packet[:last]),
        ("cut", "a packet without its last integer", packet[:-size]),
        ("odd", "a packet without its last byte", packet[:-1]),
        ("long", "a packet with an integer more", packet + bytes(size)),
        ("inside", "a packet with a frame after its array", packet + raw),
        ("most", "the longest packet, of zeros", bytes(layout.longest)),
    ):
        frame = data_frame(id, wrong, dest, source)
        yield f"{name}.{ending}", f"{about}, then a frame", [frame + raw]
        yield f"{name}.garbage.{ending}", f"garbage, {about}, then a frame", [_DAMAGE + frame + raw]
    for ending, declared in (
        ("high", layout.longest + 1),
        ("wild", 0xFFFF),
        ("waits", layout.longest),
    ):
        frame = data_frame(id, packet, dest, source, declared)
        about = f"a frame with an array that declares {declared} bytes, then a frame"
        yield f"{name}.{ending}", about, [frame + raw]


def _addressed(protocol: Protocol, raw: bytes) -> Iterator[Scenario]:
    """Yield frames with wrong addresses."""
    flag, dest, source = raw[4] & ANNOUNCED, raw[4] & ~ANNOUNCED, raw[5]
    framing = protocol.framing
    known = {framing["host"], *framing["devices"]}
    foreign = next((address for address in range(0x7F, 0, -1) if address not in known), 0)
    for name, about, pair in (
        ("unswapped", "exchanged addresses", (source & ~ANNOUNCED, dest)),
        ("zero", "addresses 0 and 0", (0, 0)),
        ("foreign", "an unknown address", (foreign, source)),
    ):
        there = raw[:4] + bytes((pair[0] | flag, pair[1])) + raw[SIZE:]
        yield f"addresses.{name}", f"{about}, then a valid frame", [there + raw]
        yield f"garbage.{name}", f"garbage, {about}, then a valid frame", [_DAMAGE + there + raw]


def _unknown(protocol: Protocol, lead: Subject, raw: bytes) -> Iterator[Scenario]:
    """Yield unknown ids, and messages without a layout."""
    unknown = unknown_id(protocol)
    dest, source = lead.asked["dest"], lead.asked["source"]
    bare = header_frame(unknown, 0, 0, dest, source)
    yield "unknown.header", "an unknown header, then a frame", [bare + raw]
    packet = data_frame(unknown, raw, dest, source)
    yield "unknown.packet", "an unknown packet that contains a frame, then a frame", [packet + raw]
    yield (
        "unknown.garbage",
        "garbage, an unknown header, then a frame",
        [_DAMAGE + bare + raw],
    )
    foreign = header_frame(unknown, 0, 0, dest, dest)
    about = "an unknown header with invalid addresses, then a frame"
    yield "unknown.addresses", about, [foreign + raw]
    for message in protocol.messages:
        if message.id is not None and not message.layouts:
            for frame, (name, about, _) in undocumented_frames(protocol, message).items():
                ending = f"{message.name}.{name}"
                yield ending, f"{message.name}, {about}, then a frame", [frame + raw]


def _packets(framing: Framing, lead: Subject, raw: bytes) -> Iterator[Scenario]:
    """Yield packets of wrong lengths, and a packet without the data flag."""
    id, dest, source = id_of(lead.message), lead.asked["dest"], lead.asked["source"]
    packet = raw[SIZE:]
    short = data_frame(id, b"", dest, source)
    yield "short", "a packet shorter than every layout, then a frame", [short + raw]
    for surplus in (1, SIZE - 1, SIZE):
        if lead.layout.length + surplus <= MOST:
            longer = framing.frame(lead, lead.plain.held, b"\xa5" * surplus)
            about = f"a packet with {surplus} extra bytes, then a frame"
            yield f"extra.{surplus}", about, [longer + raw]
    declared = min(len(packet) + len(raw), MOST)
    damaged = data_frame(id, packet, dest, source, declared)
    about = "a damaged length that covers the next frame"
    yield "length.damaged", about, [damaged + raw + raw]
    beyond = data_frame(id, packet, dest, source, MOST + 1)
    yield "length.above", "an impossible length, then a frame", [beyond + raw]
    bare = raw[:4] + bytes((dest, source))
    yield "unannounced", "a packet without the data flag, then a frame", [bare + packet + raw]


def _headers(framing: Framing, lead: Subject, headers: Sequence[Subject]) -> Iterator[Scenario]:
    """Yield headers without a packet, and bytes that only look like one."""
    bare = framing.frame(headers[0], headers[0].plain.held)
    yield "header", "two headers", [bare, bare]
    yield "header.garbage", "a byte of garbage, then two headers", [_DAMAGE + bare + bare]
    zero = bare[:4] + b"\0\0"
    about = "a byte of garbage, a header with the addresses 0 and 0, then a valid one"
    yield "header.zero", about, [_DAMAGE + zero + bare]
    long = framing.frame(lead, lead.plain.held, bare) if lead.layout.length else b""
    if SIZE < len(long) <= SIZE + MOST:
        about = "a packet that contains a complete header, then a frame"
        yield "length.header", about, [long + framing.frame(lead, lead.plain.held)]
    for of in headers:
        lengths = [layout.length for layout in of.message.layouts if layout.form != "header"]
        if lengths:
            spelt = framing.frame(of, of.plain.held)
            spelt = spelt[:2] + lengths[0].to_bytes(2, "little") + spelt[4:]
            about = "a header whose parameters equal the length of a packet, then a valid one"
            yield f"{of.message.name}.spelt", about, [spelt + bare]
        if of.layout.only_zero:
            other = framing.frame(of, of.plain.held)
            other = other[:2] + b"\0\1" + other[4:]
            about = "a header with a 1 where only zeros are allowed, then a valid one"
            yield f"{of.message.name}.not_zero", about, [other + bare]

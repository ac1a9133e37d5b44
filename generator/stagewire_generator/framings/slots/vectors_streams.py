"""The bytes of commands in slots, and streams of commands and replies.

A controller reads the commands, the host the replies. This is a simple implementation of the rule that reads
a stream slot by slot.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.vectors.framing import (
    Piece,
    Scenario,
    cut,
    in_bytes,
    stream_answer,
    stream_case,
)
from stagewire_generator.targets.vectors.subject import Case, Subject
from stagewire_generator.targets.vectors.values import (
    fields_from_bytes,
    fields_to_bytes,
    greatest_but,
)

WITH, WITHOUT = "request:with_size", "request:without_size"
SLOTS: Final = 3  # number of bytes before the data: axis, command, size
MOST: Final = SLOTS + 255 + 1  # length of the longest command


class Marks:
    """The bytes with a special meaning, and the axis of the commands."""

    def __init__(self, protocol: Protocol) -> None:
        framing = protocol.framing
        self.prefix: int = framing["prefix"]
        self.terminator: int = framing["terminator"]
        self.setup = {
            message.id: message.name
            for message in protocol.messages
            if message.kind == "setup" and message.id is not None
        }
        axes = next(e for e in protocol.enumerations if e.name == framing["axes"])
        self.axis = axes.values[0].value

    def command(self, of: Subject, data: bytes, size: int | None, extra: bytes = b"") -> bytes:
        """Return the bytes of a command; ``size`` is the value of its size slot, None omits the slot."""
        assert of.message.id is not None
        slot = b"" if size is None else bytes((size,))
        head = bytes((self.axis, of.message.id))
        return head + slot + data + extra + bytes((self.terminator,))


class SlotsReader:
    """Reads commands as a controller does."""

    def __init__(self, protocol: Protocol) -> None:
        self._marks = Marks(protocol)
        self._sizes: dict[
            int, tuple[int, int]
        ] = {}  # command byte -> length of the data, value of the size slot
        for message in protocol.messages:
            if message.kind == "command" and message.id is not None:
                request = next(layout for layout in message.layouts if layout.form == "request")
                self._sizes[message.id] = request.length, message.size or 0

    def read(self, stream: bytes) -> list[Piece]:
        """Return the pieces of a stream; adjacent garbage is joined."""
        return cut(stream, self._begins)

    def _begins(self, rest: bytes) -> tuple[str, int]:
        """Return the kind and the length of the piece at the start."""
        prefix, end = self._marks.prefix, self._marks.terminator
        if rest[0] == end:
            return "garbage", 1
        if len(rest) < 2:
            return "pending", len(rest)
        if rest[0] == prefix:
            return ("message", 2) if rest[1] in self._marks.setup else self._garbage(rest, 1)
        if rest[1] == end:
            return "garbage", 2
        kind, data = "unknown", 2
        if rest[1] in self._sizes:
            if len(rest) < SLOTS:
                return "pending", len(rest)
            length, size = self._sizes[rest[1]]
            if rest[2] == end:
                return ("bad_length" if length else "message"), SLOTS
            right = rest[2] == size
            kind, data = ("message", SLOTS + length) if right else ("bad_length", SLOTS)
        found = rest.find(end, data, MOST)
        if found >= 0:
            return kind, found + 1
        return self._garbage(rest, MOST) if len(rest) >= MOST else ("pending", len(rest))

    def _garbage(self, rest: bytes, start: int) -> tuple[str, int]:
        """Return garbage up to the next terminator, or to the end of the stream."""
        found = rest.find(self._marks.terminator, start)
        return "garbage", found + 1 if found >= 0 else len(rest)


def layout_stream(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the plain bytes of a layout as a stream in two chunks, at the receiving end."""
    half = len(raw) // 2
    chunks = [raw[:half], raw[half:]]
    if of.layout.form != "reply":
        expected = stream_answer(SlotsReader(protocol).read(raw), lambda _: of.answer(of.plain))
        yield of.stream("plain", "", chunks, expected, end="device")
        return
    asked = {"end": "host", "command": of.message.name}
    for name, about, came, pieces in (
        ("plain", "", chunks, [("message", raw)]),
        ("pending", "an incomplete reply", [raw[:-1]], [("pending", raw[:-1])]),
        ("garbage", "a reply and an unsolicited byte", [raw + b"\xa5"],
         [("message", raw), ("garbage", b"\xa5")]),
        ("none", "no reply", [], []),
    ):  # fmt: skip
        expected = stream_answer(pieces, lambda _: of.answer(of.plain))
        yield of.stream(name, about, came, expected, **asked)


def stream_cases(protocol: Protocol, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield streams of commands, and wrong requests at the end that receives replies."""
    marks = Marks(protocol)
    reader, decode = SlotsReader(protocol), _Decoder(marks, subjects)
    sent = [of for of in subjects if of.layout.form == "request"]
    commands = [of for of in sent if of.message.kind == "command"]
    for scenario in _scenarios(marks, commands) if commands else ():
        expected = stream_answer(reader.read(b"".join(scenario[2])), decode)
        for end in ("device", "none"):
            yield stream_case(f"stream/{end}", scenario, expected, end=end)
    nobody: Scenario = ("nobody", "replies without a command", [b"\0"])
    yield stream_case("stream/host", nobody, "bad_request", end="host")
    command: Scenario = ("command", "a command at the end that receives commands", [b"\0"])
    for of in sent[:1]:
        asked = of.message.name
        yield stream_case("stream/device", command, "bad_request", end="device", command=asked)
    answered = {of.message.name for of in subjects if of.layout.form == "reply"}
    garbage = stream_answer([("garbage", b"\0")], decode)
    for name in [of.message.name for of in sent if of.message.name not in answered]:
        silent: Scenario = (name, f"bytes after {name}, which has no reply", [b"\0"])
        yield stream_case("stream/host", silent, garbage, end="host", command=name)


class _Decoder:
    """Decodes the commands of a stream."""

    def __init__(self, marks: Marks, subjects: Sequence[Subject]) -> None:
        self._marks = marks
        sent = [of for of in subjects if of.layout.form == "request"]
        self._subjects = {(of.message.kind, of.message.id): of for of in sent}

    def __call__(self, raw: bytes) -> Json:
        """Return the answer of a decoder to a command."""
        setup = raw[0] == self._marks.prefix
        of = self._subjects["setup" if setup else "command", raw[1]]
        if setup:
            return {**of.says, "fields": {}}
        sized = len(raw) > SLOTS
        form = of.says["form"]
        if sized != (of.message.size is not None):
            form = WITH if sized else WITHOUT
        values = fields_from_bytes(of.fields, raw[SLOTS:])
        says = {**of.says, "form": form, "axis": raw[0], "fields": values}
        extra = raw[SLOTS + of.layout.length : -1]
        return {**says, "extra": extra.hex()} if extra else says


def _scenarios(marks: Marks, commands: Sequence[Subject]) -> Iterator[Scenario]:
    end = bytes((marks.terminator,))
    raws = [_plain(marks, of) for of in commands]
    raw, bare = (
        max(raws, key=len),
        min(raws, key=len),
    )  # the longest one can be damaged in most ways
    yield "nothing", "no chunks", []
    yield "empty", "chunks without bytes", [b"", b""]
    yield "bytes", "one byte at a time", in_bytes(raw + bare)
    yield "every", "every command", [b"".join(raws)]
    yield "pending", "an incomplete second command", [bare + raw[:-1]]
    yield "pending.axis", "only the axis of a second command", [bare, bare[:1]]
    yield "terminator", "a terminator, then a command", [end + bare]
    yield "aborted", "an aborted command, then a command", [bare[:1] + end + bare]
    for at in range(len(raw)):
        about = f"a command without its byte {at}, then three commands"
        yield f"lost.{at}", about, [raw[:at] + raw[at + 1 :] + 3 * bare]
    extra = _plain(marks, commands[0])[:-1] + b"\xa5" + end
    yield "extra", "a byte before the terminator, then a command", [extra + bare]
    yield from _unknown(marks, commands, bare)
    yield from _setup(marks, bare)
    for of in [of for of in commands if of.layout.length][:1]:
        yield from _sized(marks, of, bare)


def _unknown(marks: Marks, commands: Sequence[Subject], bare: bytes) -> Iterator[Scenario]:
    """Yield unknown command bytes, and a command that is too long."""
    end = bytes((marks.terminator,))
    unknown = greatest_but({of.message.id for of in commands} | {marks.terminator}, 1)
    if unknown is None:
        return
    head = bytes((marks.axis, unknown))
    yield "unknown", "an unknown command byte, then a command", [head + b"\1\2" + end + bare]
    long = head + b"\xa5" * MOST
    yield "long", "too many bytes, then a command", [long + end + bare]
    yield "long.pending", "too many bytes without a terminator", [long]


def _setup(marks: Marks, bare: bytes) -> Iterator[Scenario]:
    """Yield setup commands, and a prefix without a setup command."""
    for byte in sorted(marks.setup):
        setup = bytes((marks.prefix, byte))
        about = f"{marks.setup[byte]} twice and a command, one byte at a time"
        yield f"setup.{marks.setup[byte]}", about, in_bytes(setup + setup + bare)
    yield "setup.pending", "only the prefix", [bytes((marks.prefix,))]
    other = greatest_but({*marks.setup, marks.terminator}, 1)
    if other is not None:
        wrong = bytes((marks.prefix, other, marks.terminator))
        yield "setup.unknown", "an unknown setup command, then a command", [wrong + bare]


def _sized(marks: Marks, of: Subject, bare: bytes) -> Iterator[Scenario]:
    """Yield a command with a wrong or missing size, and data that contain terminators."""
    data = fields_to_bytes(of.fields, of.plain.held)
    wrong = marks.command(of, data, of.layout.length - 1)
    yield "size.other", "a wrong size, then a command", [wrong + bare]
    missing = marks.command(of, b"", None)
    yield "size.missing", "no size and no data, then a command", [missing + bare]
    ends = marks.command(of, bytes((marks.terminator,)) * of.layout.length, of.message.size)
    yield "size.terminators", "data consisting of terminators, then a command", [ends + bare]


def _plain(marks: Marks, of: Subject) -> bytes:
    return marks.command(of, fields_to_bytes(of.fields, of.plain.held), of.message.size)

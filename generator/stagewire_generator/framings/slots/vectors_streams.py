"""The bytes of commands in slots, and streams of commands and replies.

A controller reads the commands, the host the replies. The rule by which a stream is read slot by slot is
written down here as simply as it can be said.
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
SLOTS: Final = 3  # bytes before the data: axis, command, size
MOST: Final = SLOTS + 255 + 1  # bytes of the longest command


class Marks:
    """The bytes that mean something by themselves, and the axis that commands are sent to."""

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
        """Return the bytes of a command; ``size`` stands in its slot, which None leaves out."""
        assert of.message.id is not None
        slot = b"" if size is None else bytes((size,))
        head = bytes((self.axis, of.message.id))
        return head + slot + data + extra + bytes((self.terminator,))


class SlotsReader:
    """Reads what a host sends as the controller does."""

    def __init__(self, protocol: Protocol) -> None:
        self._marks = Marks(protocol)
        self._sizes: dict[
            int, tuple[int, int]
        ] = {}  # byte -> length of the data, number in the slot
        for message in protocol.messages:
            if message.kind == "command" and message.id is not None:
                request = next(layout for layout in message.layouts if layout.form == "request")
                self._sizes[message.id] = request.length, message.size or 0

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream consists of; adjacent garbage is joined."""
        return cut(stream, self._begins)

    def _begins(self, rest: bytes) -> tuple[str, int]:
        """Return what begins where a command is due, and its bytes."""
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
        """Return garbage up to the next terminator, or to the end of what has come."""
        found = rest.find(self._marks.terminator, start)
        return "garbage", found + 1 if found >= 0 else len(rest)


def layout_stream(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the plain bytes of a layout as a stream in two chunks, at the end that receives them."""
    half = len(raw) // 2
    chunks = [raw[:half], raw[half:]]
    if of.layout.form != "reply":
        expected = stream_answer(SlotsReader(protocol).read(raw), lambda _: of.answer(of.plain))
        yield of.stream("plain", "", chunks, expected, end="device")
        return
    asked = {"end": "host", "command": of.message.name}
    for name, about, came, pieces in (
        ("plain", "", chunks, [("message", raw)]),
        ("pending", "not all there", [raw[:-1]], [("pending", raw[:-1])]),
        ("garbage", "and a byte that nobody asked for", [raw + b"\xa5"],
         [("message", raw), ("garbage", b"\xa5")]),
        ("none", "and nothing came", [], []),
    ):  # fmt: skip
        expected = stream_answer(pieces, lambda _: of.answer(of.plain))
        yield of.stream(name, about, came, expected, **asked)


def stream_cases(protocol: Protocol, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield streams of commands, and what is refused at the end of the line where replies come."""
    marks = Marks(protocol)
    reader, decode = SlotsReader(protocol), _Decoder(marks, subjects)
    sent = [of for of in subjects if of.layout.form == "request"]
    commands = [of for of in sent if of.message.kind == "command"]
    for scenario in _scenarios(marks, commands) if commands else ():
        expected = stream_answer(reader.read(b"".join(scenario[2])), decode)
        for end in ("device", "none"):
            yield stream_case(f"stream/{end}", scenario, expected, end=end)
    nobody: Scenario = ("nobody", "replies, and nobody says to what", [b"\0"])
    yield stream_case("stream/host", nobody, "bad_request", end="host")
    command: Scenario = ("command", "a command that is answered where commands come", [b"\0"])
    for of in sent[:1]:
        asked = of.message.name
        yield stream_case("stream/device", command, "bad_request", end="device", command=asked)
    answered = {of.message.name for of in subjects if of.layout.form == "reply"}
    garbage = stream_answer([("garbage", b"\0")], decode)
    for name in [of.message.name for of in sent if of.message.name not in answered]:
        silent: Scenario = (name, f"bytes after {name}, which is not answered", [b"\0"])
        yield stream_case("stream/host", silent, garbage, end="host", command=name)


class _Decoder:
    """Decodes the commands of a stream."""

    def __init__(self, marks: Marks, subjects: Sequence[Subject]) -> None:
        self._marks = marks
        sent = [of for of in subjects if of.layout.form == "request"]
        self._subjects = {(of.message.kind, of.message.id): of for of in sent}

    def __call__(self, raw: bytes) -> Json:
        """Return what a decoder says of a command."""
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
    raw, bare = max(raws, key=len), min(raws, key=len)  # the longest can be damaged in most ways
    yield "nothing", "nothing at all", []
    yield "empty", "chunks without bytes", [b"", b""]
    yield "bytes", "one byte at a time", in_bytes(raw + bare)
    yield "every", "every command", [b"".join(raws)]
    yield "pending", "a second command that is not all there", [bare + raw[:-1]]
    yield "pending.axis", "a second command of which only the axis is there", [bare, bare[:1]]
    yield "terminator", "a terminator alone, then a command", [end + bare]
    yield "aborted", "a command that was aborted, then one", [bare[:1] + end + bare]
    for at in range(len(raw)):
        about = f"a command that lost its byte {at}, then three"
        yield f"lost.{at}", about, [raw[:at] + raw[at + 1 :] + 3 * bare]
    extra = _plain(marks, commands[0])[:-1] + b"\xa5" + end
    yield "extra", "a byte before the terminator, then a command", [extra + bare]
    yield from _unknown(marks, commands, bare)
    yield from _setup(marks, bare)
    for of in [of for of in commands if of.layout.length][:1]:
        yield from _sized(marks, of, bare)


def _unknown(marks: Marks, commands: Sequence[Subject], bare: bytes) -> Iterator[Scenario]:
    """Yield bytes that no command has, and what is longer than any."""
    end = bytes((marks.terminator,))
    unknown = greatest_but({of.message.id for of in commands} | {marks.terminator}, 1)
    if unknown is None:
        return
    head = bytes((marks.axis, unknown))
    yield "unknown", "a byte that no command has, then a command", [head + b"\1\2" + end + bare]
    long = head + b"\xa5" * MOST
    yield "long", "longer than any command, then a command", [long + end + bare]
    yield "long.pending", "longer than any command, without an end", [long]


def _setup(marks: Marks, bare: bytes) -> Iterator[Scenario]:
    """Yield setup commands, and a prefix that begins none."""
    for byte in sorted(marks.setup):
        setup = bytes((marks.prefix, byte))
        about = f"{marks.setup[byte]} twice, and a command, one byte at a time"
        yield f"setup.{marks.setup[byte]}", about, in_bytes(setup + setup + bare)
    yield "setup.pending", "the prefix alone", [bytes((marks.prefix,))]
    other = greatest_but({*marks.setup, marks.terminator}, 1)
    if other is not None:
        wrong = bytes((marks.prefix, other, marks.terminator))
        yield "setup.unknown", "the prefix before another byte, then a command", [wrong + bare]


def _sized(marks: Marks, of: Subject, bare: bytes) -> Iterator[Scenario]:
    """Yield a command with data whose size is another or missing, and data that end nothing."""
    data = fields_to_bytes(of.fields, of.plain.held)
    wrong = marks.command(of, data, of.layout.length - 1)
    yield "size.other", "another size than its own, then a command", [wrong + bare]
    missing = marks.command(of, b"", None)
    yield "size.missing", "no size and no data, then a command", [missing + bare]
    ends = marks.command(of, bytes((marks.terminator,)) * of.layout.length, of.message.size)
    yield "size.terminators", "data that are terminators, then a command", [ends + bare]


def _plain(marks: Marks, of: Subject) -> bytes:
    return marks.command(of, fields_to_bytes(of.fields, of.plain.held), of.message.size)

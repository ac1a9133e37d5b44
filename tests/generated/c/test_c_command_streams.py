"""The C parser of commands compared with the Python framer, with damaged streams in random chunks."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from command_library import CommandLibrary
from command_readers import Event
from hypothesis import given, settings
from hypothesis import strategies as st
from toolchain import CORTEX_M0, C, compiles, need

from stagewire.framing import (
    BadCommandLength,
    CommandReceived,
    Garbage,
    UnknownCommand,
    join_garbage,
)
from stagewire.protocols import Command, CommandProtocol

STREAMS = 3000
KINDS = {
    CommandReceived: "message",
    UnknownCommand: "unknown",
    BadCommandLength: "bad_length",
    Garbage: "garbage",
}


def chunks_of(rng: Random, stream: bytes) -> list[bytes]:
    """Cut a stream at random, byte by byte, or not at all."""
    step = rng.choice((1, 3, 10, 300, len(stream) + 1))
    chunks, at = [], 0
    while at < len(stream):
        size = rng.randint(1, step)
        chunks.append(stream[at : at + size])
        at += size
    return chunks


def joined(events: list[Event]) -> list[Event]:
    """Return events with adjacent garbage joined."""
    found: list[Event] = []
    for event in events:
        if event.kind == "garbage" and found and found[-1].kind == "garbage":
            event = Event("garbage", found.pop().raw + event.raw)
        found.append(event)
    return found


def in_python(library: CommandLibrary, stream: bytes) -> tuple[list[Event], bytes]:
    framer = library.protocol.framer()
    events = join_garbage(framer.feed(stream))
    return [Event(KINDS[type(event)], event.raw) for event in events], framer.pending


def in_c(library: CommandLibrary, chunks: list[bytes]) -> tuple[list[Event], bytes]:
    parser = library.parser()
    events = [event for chunk in chunks for event in parser.feed(chunk)]
    assert b"".join(event.raw for event in events) + parser.pending == b"".join(chunks)
    return joined(events), parser.pending


def a_byte(rng: Random, protocol: CommandProtocol) -> int:
    marks = protocol.marks
    known = (marks.prefix, marks.terminator, *marks.setup, 0, 3)
    return rng.choice(known) if rng.random() < 0.5 else rng.randrange(0x100)


def a_command(rng: Random, protocol: CommandProtocol) -> bytes:
    """Return a command, usually complete and valid."""
    marks = protocol.marks
    if rng.random() < 0.1:
        return bytes((marks.prefix, rng.choice([*marks.setup, a_byte(rng, protocol)])))
    layout = rng.choice([cls for cls in protocol.messages if issubclass(cls, Command)]).layout
    content = bytes(a_byte(rng, protocol) for _ in range(layout.length))
    slot = rng.choice([bytes((layout.size or 0,))] * 6 + [b"", bytes((a_byte(rng, protocol),))])
    extra = bytes((a_byte(rng, protocol),)) * rng.choice([0] * 9 + [1, 2, 120, 250, 256, 300])
    head = bytes((rng.choice(sorted(protocol.axes.values())), layout.id))
    return head + slot + content + extra + bytes((marks.terminator,))


def a_stream(rng: Random, protocol: CommandProtocol) -> bytes:
    """Return a few commands, some of them damaged."""
    stream = b"".join(a_command(rng, protocol) for _ in range(rng.choice((1, 2, 4, 8))))
    for _ in range(rng.choice((0, 1, 2, 3))):
        at = rng.randrange(len(stream) + 1)
        rest = at + rng.choice((0, 1, 1, 2, 4))
        put = bytes(a_byte(rng, protocol) for _ in range(rng.choice((0, 1, 1, 2))))
        stream = stream[:at] + put + stream[rest:]
    return stream


def test_damaged_streams_give_the_same_events(library: CommandLibrary) -> None:
    seen = dict.fromkeys((*KINDS.values(), "pending", "longest"), 0)
    for seed in range(STREAMS):
        rng = Random(seed)
        stream = a_stream(rng, library.protocol)
        wanted = in_python(library, stream)
        assert in_c(library, chunks_of(rng, stream)) == wanted, (seed, stream.hex(" "))
        for event in wanted[0]:
            seen[event.kind] += 1
        seen["pending"] += bool(wanted[1])
        seen["longest"] += any(len(event.raw) >= 259 for event in wanted[0])
    assert min(seen.values()) > STREAMS // 50  # all kinds of events occurred


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_any_bytes_give_the_same_events(library: CommandLibrary, data: st.DataObject) -> None:
    marks = library.protocol.marks
    known = st.sampled_from((marks.prefix, marks.terminator, 0x01, *library.protocol.rule.requests))
    chunks = data.draw(st.lists(st.lists(known | st.integers(0, 0xFF)).map(bytes)))
    assert in_c(library, chunks) == in_python(library, b"".join(chunks))


@pytest.mark.parametrize("size", [256, 257, 258, 259, 260, 261, 600])
def test_bounds_of_the_longest_command(library: CommandLibrary, size: int) -> None:
    """The terminator comes just in time or just too late; the next bytes are a command again."""
    end = bytes((library.protocol.marks.terminator,))
    for cls in library.protocol.messages:
        if issubclass(cls, Command):
            head = bytes((1, cls.layout.id, cls.layout.size or 0))
            stream = head.ljust(size - 1, b"\1") + end + bytes((1, cls.layout.id)) + end
            wanted = in_python(library, stream)
            for step in (1, 100, 258, 259, 1000):
                chunks = [stream[at : at + step] for at in range(0, len(stream), step)]
                assert in_c(library, chunks) == wanted


def test_a_parser_can_be_initialised_again(library: CommandLibrary) -> None:
    marks = library.protocol.marks
    parser = library.parser()
    for unfinished in (b"\1", bytes((marks.prefix, 0)), b"\1" * 400):
        parser.feed(unfinished)
        parser.call("init", parser.state)
        assert parser.pending == b""
        raw = bytes((marks.prefix, next(iter(marks.setup))))
        assert parser.feed(raw) == [Event("message", raw)]


def test_an_event_consumes_only_its_own_bytes(library: CommandLibrary) -> None:
    """The caller keeps the rest, and may stop parsing at a setup command."""
    marks = library.protocol.marks
    setup = bytes((marks.prefix, next(iter(marks.setup))))
    event, rest = library.parser().next(setup + b"text")
    assert (event, rest) == (Event("message", setup), b"text")


@pytest.mark.matrix
def test_parser_and_reader_are_small_on_a_cortex_m0(tmp_path: Path) -> None:
    need("arm-none-eabi-gcc")
    text = '#include "stagewire_ms2000/stagewire_ms2000.h"\n'
    text += "MS2000_STATIC_ASSERT(sizeof(ms2000_parser) <= 280U, parser_is_small);\n"
    text += "MS2000_STATIC_ASSERT(sizeof(ms2000_replies) <= 16U, reader_is_small);\n"
    (tmp_path / "sizes.c").write_text(text, encoding="utf-8")
    compiles("arm-none-eabi-gcc", *CORTEX_M0, "-I", C, "-c", tmp_path / "sizes.c", cwd=tmp_path)

"""Streams through the C parser (``stream_main.c``) and through the Python framer."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

from toolchain import C_WARNINGS, compiles

from stagewire.framing import (
    BadLength,
    End,
    Event,
    Framer,
    FramingTable,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    join_garbage,
)

PENDING = "pending"
KINDS = {
    1: Received,
    2: Undocumented,
    3: Unknown,
    4: BadLength,
    5: Garbage,
    ord("p"): PENDING,
}
WORK = ord("w")
ENDS = {End.HOST: 1, End.DEVICE: 2, End.NONE: 3}


class GiveUp:
    """A step that abandons the pending frame."""


Block = bytes
Step = Block | type[GiveUp]
Seen = tuple[object, bytes]
"""The class of an event or PENDING, and the bytes."""


@dataclass(frozen=True)
class Given:
    """The output of the C program for a stream: events, which of them are in place, and the work."""

    events: list[Seen]
    in_place: list[bool]
    work: list[int]


class Program:
    """The parser of one package, compiled."""

    def __init__(
        self, c: Path, package: str, made: Path, *words: object, beside: Path | None = None
    ) -> None:
        """Compile; the code that counts the work is not counted."""
        self._made = made
        main = Path(__file__).with_name("stream_main.c")
        prefix = package.removeprefix("stagewire_")
        options = [*C_WARNINGS, f"-I{c}", f'-DPARSER="{package}/parser.h"', f"-DPREFIX={prefix}"]
        source = made.with_suffix(".o")
        counts = ["-fsanitize-coverage=trace-pc"] if words[0] == "gcc" else []
        compiles(*words, *counts, *options, "-c", c / package / f"{package}.c", "-o", source)
        compiles(*words, *options, main, *([beside] if beside else []), source, "-o", made)

    def asked(self, streams: Iterable[tuple[End, list[Step]]]) -> bytes:
        """Return the input of the program for some streams, each with a new parser."""
        asked = bytearray()
        for end, steps in streams:
            asked += b"i" + bytes((ENDS[end],))
            for step in steps:
                asked += b"pa" if isinstance(step, type) else b"f" + _size(step) + step
            asked += b"wpap"
        return bytes(asked)

    def run(self, asked: bytes, *before: object) -> subprocess.CompletedProcess[bytes]:
        """Run the program, optionally with a wrapper command."""
        words = [*map(str, before), str(self._made)]
        return subprocess.run(words, input=asked, capture_output=True, timeout=120, check=False)

    def give(self, streams: Iterable[tuple[End, list[Step]]]) -> list[Given]:
        """Return the output for each stream; pending bytes are abandoned at its end."""
        done = self.run(self.asked(streams))
        assert done.returncode == 0, done.stderr.decode(errors="replace")
        return list(_given(done.stdout))


def _size(block: bytes) -> bytes:
    return len(block).to_bytes(4, "little")


def _given(output: bytes) -> Iterator[Given]:
    given = None
    at = 0
    while at < len(output):
        what, in_place = output[at], bool(output[at + 1])
        size = int.from_bytes(output[at + 2 : at + 6], "little")
        raw = output[at + 6 : at + 6 + size]
        at += 6 + size
        if what == ord("i"):
            if given:
                yield given
            given = Given([], [], [])
            continue
        assert given is not None
        if what == WORK:
            given.work.append(int.from_bytes(raw, "little"))
        else:
            given.events.append((KINDS[what], raw))
            given.in_place.append(in_place)
    if given:
        yield given


def in_python(table: FramingTable, end: End, steps: list[Step]) -> list[Seen]:
    """Return the output of the Python framer for the same steps."""
    framer = Framer(table, end)
    seen: list[Seen] = []

    def give_up() -> None:
        seen.append((PENDING, framer.pending))
        seen.extend(_seen(framer.abandon()))

    for step in steps:
        if isinstance(step, type):
            give_up()
        else:
            seen += _seen(framer.feed(step))
    give_up()
    seen.append((PENDING, framer.pending))
    return joined(seen)


def _seen(events: list[Event]) -> list[Seen]:
    """Return the events; C does not distinguish unknown ids from unknown sub-messages."""
    return [
        (Unknown if isinstance(event, Unknown) else type(event), event.raw)
        for event in join_garbage(events)
    ]


def joined(seen: list[Seen]) -> list[Seen]:
    """Return events with adjacent garbage joined."""
    found: list[Seen] = []
    for kind, raw in seen:
        if kind is Garbage and found and found[-1][0] is Garbage:
            raw = found.pop()[1] + raw
        found.append((kind, raw))
    return found


def cut(rng: Random, stream: bytes) -> list[Block]:
    """Cut a stream at random: into bytes, small blocks, large blocks, or not at all."""
    longest = rng.choice((1, 3, 8, 40, 400, len(stream) + 1))
    blocks, at = [], 0
    while at < len(stream):
        size = rng.randint(1, longest) if longest <= len(stream) else len(stream)
        blocks.append(stream[at : at + size])
        at += size
    return blocks


def steps_of(rng: Random, stream: bytes) -> list[Step]:
    """Cut a stream at random, with silences in which a frame is abandoned."""
    steps: list[Step] = []
    silences = rng.choice((0, 0, 0.01, 0.1))
    for block in cut(rng, stream):
        steps.append(block)
        if rng.random() < silences:
            steps.append(GiveUp)
    return steps

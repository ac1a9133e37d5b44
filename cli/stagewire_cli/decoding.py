"""One run of ``stagewire decode``: reads an input, passes it to a writer, and counts events."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from stagewire.capture import Heading, Recorded
from stagewire.framing import End, Event, Garbage
from stagewire.protocols import Direction
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.task import Stamp, Task
from stagewire_cli.formats.writer import Writer
from stagewire_cli.inputs import Source, captures, chunks, heading, is_json, opening, session
from stagewire_cli.output import Progress
from stagewire_conformance.framings import EVENT_NAMES

# Unknown messages are not errors: newer controllers send messages that the registry lacks.
_WRONG = ("refused", "garbage", "bad_length")


class Counts:
    """Counts frames, or the events of a stream."""

    def __init__(self) -> None:
        self.read = 0
        self.counts: Counter[str] = Counter()
        self._pending = 0
        self._in_garbage: dict[object, bool] = {}

    def frame(self, raw: bytes, right: bool) -> None:
        """Count a frame that must be valid."""
        self.read += len(raw)
        self.counts["frame" if right else "refused"] += 1

    def events(self, events: Sequence[Event], part: bytes, stream: object = None) -> None:
        """Count the events of a part of a stream; garbage that is cut by blocks counts once.

        ``stream`` identifies one of several streams.
        """
        self.read += len(part)
        if not events:
            return
        for kind, number in Counter(map(type, events)).items():
            self.counts[EVENT_NAMES[kind]] += number
        if self._in_garbage.get(stream) and type(events[0]) is Garbage:
            self.counts[EVENT_NAMES[Garbage]] -= 1
        self._in_garbage[stream] = type(events[-1]) is Garbage

    def end(self, pending: bytes) -> None:
        """Count the incomplete bytes at the end of a stream."""
        self._pending += len(pending)

    @property
    def right(self) -> bool:
        """Whether everything was valid."""
        return not self._pending and not any(self.counts[kind] for kind in _WRONG)

    @property
    def summary(self) -> str:
        """A summary of the events, in one line."""
        found = [f"{number} {kind}" for kind, number in sorted(self.counts.items())]
        found += [f"{self._pending} bytes incomplete"] * bool(self._pending)
        return f"{self.read} bytes: {', '.join(found) or 'nothing'}"


_NOW_AND_THEN = 1024  # frames
_WAYS = {Direction.TO_CONTROLLER: "to_controller", Direction.TO_HOST: "to_host"}


@dataclass(frozen=True)
class Input:
    """An opened input.

    :param source: a file or standard input; None for bytes on the command line.
    :param block: its first block, or those bytes.
    :param text: the same as text; None if it is not text.
    """

    source: Source | None
    block: bytes
    text: str | None

    @cached_property
    def heading(self) -> Heading | None:
        """The header of a recorded session; None for any other input."""
        return heading(self.text)


@contextmanager
def opened(given: Path | bytes | None) -> Iterator[Input]:
    """Yield the input that the arguments name, with its first block read."""
    if isinstance(given, bytes):
        yield Input(None, given, None)
        return
    with ExitStack() as files:
        stream = sys.stdin.buffer if given is None else files.enter_context(given.open("rb"))
        source = Source(stream)
        yield Input(source, *opening(source))


@dataclass(frozen=True)
class Decoding:
    """One run of the command, which decodes an input, writes the results and counts events."""

    task: Task
    writer: Writer
    end: End | None
    total: Counts
    say: Progress

    def of(self, read: Input) -> None:
        """Decode an input."""
        source, block, text = read.source, read.block, read.text
        if source is None:
            if self.end is not None:
                self._stream([block])
            else:
                self.total.frame(block, self.writer.frame(0, block))
        elif read.heading:
            self._has_no_end("a recorded session has both ends")
            self._session(source, block)
        elif is_json(text):
            self._has_no_end("JSON captures are single frames")
            self._captures(source, block)
        else:
            self._stream(chunks(source, block, text), source)

    def _has_no_end(self, why: str) -> None:
        if self.end is not None:
            raise CalledWronglyError(f"--end requires a stream; {why}")

    def _captures(self, source: Source, block: bytes) -> None:
        for name, raw in captures(source, block):
            self.total.frame(raw, self.writer.frame(self.total.read, raw, name))
            if self.total.counts.total() % _NOW_AND_THEN == 0:
                self.say(f"{source.progress}, {self.total.counts['frame']:,} frames")

    def _session(self, source: Source, block: bytes) -> None:
        readers = self.task.readers()
        latest: dict[Direction, Recorded] = {}
        for part in session(source, block):
            for recorded in part:
                way = recorded.direction
                latest[way] = recorded
                events = readers[way].feed(recorded.data)
                self.task.stamp = _stamp(recorded)
                for event in events:
                    self.writer.events(recorded.line, [event])
                self.total.events(events, recorded.data, way)
            self.writer.flush()
            self.say(f"{source.progress}, {self.total.counts['message']:,} messages")
        for way, recorded in latest.items():
            if pending := bytes(readers[way].pending):
                self.task.stamp = _stamp(recorded)
                self.writer.pending(recorded.line, pending)
                self.total.end(pending)

    def _stream(self, parts: Iterable[bytes], source: Source | None = None) -> None:
        reader = self.task.reader(self.end)
        for part in parts:
            offset = self.total.read - len(reader.pending)
            events = reader.feed(part)
            self.writer.events(offset, events)
            self.writer.flush()
            self.total.events(events, part)
            if source is not None:
                self.say(f"{source.progress}, {self.total.counts['message']:,} messages")
        pending = bytes(reader.pending)
        if pending:
            self.writer.pending(self.total.read - len(pending), pending)
        self.total.end(pending)


def _stamp(recorded: Recorded) -> Stamp:
    return recorded.time / 1e9, _WAYS[recorded.direction]

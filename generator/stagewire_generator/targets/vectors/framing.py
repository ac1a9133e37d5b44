"""The interface by which framings make the cases of a protocol, and the cases of streams that they share."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.subject import Case, Expected, Subject, make_case


class Framing(abc.ABC):
    """How the messages of one protocol are framed, and what can be wrong with a frame."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    @abc.abstractmethod
    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""

    @abc.abstractmethod
    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a frame that holds values, and bytes beyond the layout."""

    @abc.abstractmethod
    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield the cases of a layout that its framing makes."""

    @abc.abstractmethod
    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield the cases of a message that are those of none of its layouts."""

    @abc.abstractmethod
    def of_protocol(self) -> Iterator[Case]:
        """Yield the cases of no message alone: addresses, unknown messages, streams, bad requests."""


Piece: TypeAlias = tuple[str, bytes]
"""The kind of an event and its bytes; bytes that wait for more are ``pending``."""

Scenario: TypeAlias = tuple[str, str, list[bytes]]
"""The end of an id, what the stream is, and its chunks."""

Decode: TypeAlias = Callable[[bytes], Json]
"""Returns what a decoder says of a frame that is a message."""


def cut(stream: bytes, begins: Callable[[bytes], tuple[str, int]]) -> list[Piece]:
    """Return what a stream consists of where every byte is read alike; adjacent garbage is joined.

    :param begins: says what begins with the first of some bytes, and how many of them it takes.
    """
    pieces = []
    while stream:
        kind, size = begins(stream)
        pieces.append((kind, stream[:size]))
        stream = stream[size:]
    return join_garbage(pieces)


def join_garbage(pieces: Iterable[Piece]) -> list[Piece]:
    """Return pieces with garbage that follows garbage made one."""
    joined: list[Piece] = []
    for kind, raw in pieces:
        if joined and joined[-1][0] == kind == "garbage":
            raw = joined.pop()[1] + raw
        joined.append((kind, raw))
    return joined


def stream_answer(pieces: Iterable[Piece], decode: Decode) -> Json:
    """Return what is answered of a stream that consists of these pieces."""
    events: list[Json] = []
    pending = b""
    for kind, raw in pieces:
        if kind == "pending":
            pending = raw
        elif kind in ("message", "undocumented"):
            events.append({"event": kind, **decode(raw)})
        else:
            events.append({"event": kind, "hex": raw.hex()})
    return {"events": events, "pending": pending.hex()}


def stream_case(prefix: str, scenario: Scenario, expected: Expected, **more: str) -> Case:
    """Return the case of a stream; ``more`` is what its request says beside the chunks."""
    name, about, chunks = scenario
    request = {"op": "stream", "chunks": [chunk.hex() for chunk in chunks], **more}
    return make_case(f"{prefix}/{name}", about, request, expected)


def in_bytes(raw: bytes) -> list[bytes]:
    """Return a chunk for each byte."""
    return [bytes((byte,)) for byte in raw]

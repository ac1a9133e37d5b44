"""The interface of framings that make the cases of a protocol, and functions for cases of streams."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.subject import Case, Expected, Subject, make_case


class Framing(abc.ABC):
    """The framing of one protocol: makes frames, and cases of wrong ones."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    @abc.abstractmethod
    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""

    @abc.abstractmethod
    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a frame with these values and extra bytes."""

    def decodes(self, of: Subject, raw: bytes) -> bool:
        """Return whether a frame with values of its format, even out of range, can be decoded."""
        return True

    @abc.abstractmethod
    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield the cases of a layout that depend on the framing."""

    @abc.abstractmethod
    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield the cases of a message that do not belong to a layout."""

    @abc.abstractmethod
    def of_protocol(self) -> Iterator[Case]:
        """Yield the cases of the protocol: addresses, unknown messages, streams, bad requests."""


Piece: TypeAlias = tuple[str, bytes]
"""The kind of an event and its bytes; incomplete bytes at the end are ``pending``."""

Scenario: TypeAlias = tuple[str, str, list[bytes]]
"""The end of an id, the description of a stream, and its chunks."""

Decode: TypeAlias = Callable[[bytes], Json]
"""Returns the answer of a decoder to a frame that is a message."""


def cut(stream: bytes, begins: Callable[[bytes], tuple[str, int]]) -> list[Piece]:
    """Return the pieces of a stream, for framings without a state; adjacent garbage is joined.

    :param begins: returns the kind and the length of the piece at the start of some bytes.
    """
    pieces = []
    while stream:
        kind, size = begins(stream)
        pieces.append((kind, stream[:size]))
        stream = stream[size:]
    return join_garbage(pieces)


def join_garbage(pieces: Iterable[Piece]) -> list[Piece]:
    """Return pieces with adjacent garbage joined."""
    joined: list[Piece] = []
    for kind, raw in pieces:
        if joined and kind == joined[-1][0] == "garbage":
            raw = joined.pop()[1] + raw
        joined.append((kind, raw))
    return joined


def stream_answer(pieces: Iterable[Piece], decode: Decode) -> Json:
    """Return the answer to a stream that consists of these pieces."""
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
    """Return the case of a stream; ``more`` are the other keys of its request."""
    name, about, chunks = scenario
    request = {"op": "stream", "chunks": [chunk.hex() for chunk in chunks], **more}
    return make_case(f"{prefix}/{name}", about, request, expected)


def in_bytes(raw: bytes) -> list[bytes]:
    """Return a chunk for each byte."""
    return [bytes((byte,)) for byte in raw]

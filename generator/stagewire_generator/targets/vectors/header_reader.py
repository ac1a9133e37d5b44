"""The rule by which a stream of frames with headers is cut, as slowly and simply as it can be said.

At each position the header that stands there is looked at anew; nothing is searched for or remembered. The
rule itself, with its reasons, is that of the library's framer.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.vectors.header_frame import ANNOUNCED, MOST, SIZE
from stagewire_generator.targets.vectors.streams import Piece, join_garbage

__all__ = ["ENDS", "HeaderReader"]

ENDS: Final = {
    "host": frozenset({"to_host"}),
    "device": frozenset({"to_controller"}),
    "none": frozenset({"to_host", "to_controller"}),
}
"""Which end of the line listens -> the directions that it receives."""


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
        self._messages = {message.id: message for message in protocol.messages}

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream consists of; adjacent garbage is joined."""
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
            if kind == "long":  # a damaged length, if a header that is ours stands inside
                inside = range(1, size - SIZE + 1)
                hit = any(self._out_of_step(rest[i:])[0] == "message" for i in inside)
                kind, size = ("garbage", 1) if hit else ("message", size)
            yield kind, rest[:size]
            at, in_step = at + size, kind != "garbage"

    def _in_step(self, rest: bytes) -> tuple[str, int]:
        """Return what begins where a frame is due, and its bytes."""
        message, word, announced, pair = self._header(rest)
        garbage = "garbage", 1
        if announced and word > MOST:
            return garbage
        size = SIZE + word if announced else SIZE
        if message is None:
            return ("unknown", size) if pair in self._right(*self._receives) else garbage
        if not message.layouts:
            receives = pair in self._right(*self._receives)
            return ("undocumented", size) if receives else garbage
        if not self._ours(message) or pair not in self._tolerated:
            return garbage
        if not announced:
            return ("message", SIZE) if self._has_header(message, word) else garbage
        lengths = _lengths(message)
        if not lengths:
            return garbage
        fitting = [length for length in lengths if length <= word]
        if not fitting:
            return "bad_length", size
        return ("message" if word - max(fitting) < SIZE else "long"), size

    def _out_of_step(self, rest: bytes) -> tuple[str, int]:
        """Return what begins where frames are looked for: a message that is exactly right, or nothing."""
        message, word, announced, pair = self._header(rest)
        if message is not None and self._ours(message):
            if announced and word in _lengths(message) and pair in self._tolerated:
                return "message", SIZE + word
            right = pair in self._right(*self._ours(message))
            if not announced and right and self._has_header(message, word):
                return "message", SIZE
        return "garbage", 1

    def _header(self, rest: bytes) -> tuple[Message | None, int, bool, tuple[int, int]]:
        """Return the message of a header, its second word, whether a packet follows, and its addresses."""
        message = self._messages.get(rest[0] | rest[1] << 8)
        announced = bool(rest[4] & ANNOUNCED)
        return message, rest[2] | rest[3] << 8, announced, (rest[4] & ~ANNOUNCED, rest[5])

    def _ours(self, message: Message) -> frozenset[str]:
        """Return the directions of a message that this end receives."""
        both = ("to_host", "to_controller")
        return self._receives & {*(both if message.direction == "both" else (message.direction,))}

    def _right(self, *directions: str) -> set[tuple[int, int]]:
        return set().union(*(self._pairs[direction] for direction in directions))

    def _has_header(self, message: Message, parameters: int) -> bool:
        """Whether a header with these parameters may be the message, and no packet that lost its bit."""
        header = next((layout for layout in message.layouts if layout.form == "header"), None)
        if header is None or parameters in _lengths(message):
            return False
        return not (header.only_zero and parameters)


def _lengths(message: Message) -> set[int]:
    return {layout.length for layout in message.layouts if layout.form != "header"}

"""What the two ends of a line say to each other, in the words of ``stagewire decode``.

Each direction is cut into events as the end that receives it cuts it; a reply without a frame is told by what
was asked.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from stagewire.commands import CommandFrame, CommandProtocol, ReplyReceived
from stagewire.framing import End, Event, Garbage
from stagewire.protocol import Protocol
from stagewire_cli.rendering import frame_line
from stagewire_conformance.answers import Decoded, frame_answer
from stagewire_conformance.codec import EVENT_NAMES, codec_of
from stagewire_conformance.codec.base import Reader

__all__ = ["Conversation", "Piece"]

Piece = tuple[bytes, str]
"""Bytes that passed, and what they completed; ``incomplete`` when that was nothing yet."""

_OUTSTANDING = 64  # requests whose replies are awaited at once; older ones are forgotten


class Conversation:
    """Reads both directions of one line; bytes of any kind are taken.

    :param protocol: what is spoken.
    :param context: what decides between layouts that bytes do not tell apart: ``{"status": "dc"}``.
    """

    def __init__(self, protocol: Protocol, context: Mapping[str, str] | None = None) -> None:
        codec = codec_of(protocol)
        request: dict[str, Any] = {"context": dict(context)} if context else {}
        self._replies = _Replies()

        def read(event: Event) -> Decoded | None:
            return codec.received(event, request)

        def words(decoded: Decoded) -> str:
            return frame_line(protocol, frame_answer(decoded))

        def asked(decoded: Decoded) -> str:
            self._replies.asked(decoded)
            return words(decoded)

        to_controller = codec.reader({**request, "end": End.DEVICE.value})
        to_host: Reader = self._replies
        if not isinstance(protocol, CommandProtocol):
            to_host = codec.reader({**request, "end": End.HOST.value})
        self._host = _Direction(to_controller, read, asked)
        self._controller = _Direction(to_host, read, words)

    def host(self, data: bytes) -> list[Piece]:
        """Return what the host said, in pieces."""
        self._replies.turn()
        return self._host.pieces(data)

    def controller(self, data: bytes) -> list[Piece]:
        """Return what the controller said, in pieces."""
        return self._controller.pieces(data)


class _Direction:
    """One direction: what cuts it, and what puts it into words."""

    def __init__(
        self,
        reader: Reader,
        read: Callable[[Event], Decoded | None],
        words: Callable[[Decoded], str],
    ) -> None:
        self._reader = reader
        self._read = read
        self._words = words

    def pieces(self, data: bytes) -> list[Piece]:
        old = len(self._reader.pending)  # given out before, though the next events begin with it
        found: list[Piece] = []
        said: list[str] = []
        at = 0
        for event in self._reader.feed(data):
            decoded = self._read(event)
            if decoded is None:
                said.append(_raw(EVENT_NAMES[type(event)], event.raw))
            else:
                said.append(self._words(decoded))
            new = max(0, len(event.raw) - old)
            old = max(0, old - len(event.raw))
            if new:
                found.append((data[at : at + new], "; ".join(said)))
                said = []
                at += new
        if at < len(data):
            found.append((data[at:], "; ".join([*said, _raw("incomplete", data[at:])])))
        return found


def _raw(kind: str, raw: bytes) -> str:
    """Name bytes that are no message; what is text all the same, as of a terminal, is shown."""
    text = raw.decode("latin-1")
    is_text = text.isascii() and text.rstrip("\r\n").isprintable() and text.strip()
    return f"{kind} {text!r}" if is_text else kind


class _Replies:
    """Cuts what a controller sends into the replies to what is outstanding, in their order.

    A host has one request outstanding, or sends several at once. One that asks again has given up what it
    asked before: a reply that was lost does not shift all that follow.
    """

    def __init__(self) -> None:
        self._outstanding: deque[CommandFrame] = deque(maxlen=_OUTSTANDING)
        self._asks_again = False
        self.pending = b""

    def turn(self) -> None:
        """Note that the host begins to speak."""
        self._asks_again = True

    def asked(self, decoded: Decoded) -> None:
        """Note what the host said; what has no reply, such as a stop, gives nothing up."""
        if not isinstance(decoded, CommandFrame) or decoded.message.reply is None:
            return
        if self._asks_again:
            self._asks_again = False
            self._outstanding.clear()
            self.pending = b""
        self._outstanding.append(decoded)

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return the replies that they complete."""
        data = self.pending + data
        events: list[Event] = []
        while data and self._outstanding:
            reply = self._outstanding[0].message.reply
            assert reply is not None  # else it would not be outstanding
            size = reply.layout.length
            if len(data) < size:
                break
            events.append(ReplyReceived(data[:size], self._outstanding.popleft()))
            data = data[size:]
        if data and not self._outstanding:
            events.append(Garbage(data))
            data = b""
        self.pending = data
        return events

"""What the two ends of a line say to each other, as it passes, in the words of ``stagewire decode``."""

from __future__ import annotations

from stagewire.framing import Event
from stagewire.protocols import Direction
from stagewire_cli.formats.task import Task
from stagewire_cli.rendering import frame_line
from stagewire_conformance.answers import frame_answer
from stagewire_conformance.codec import EVENT_NAMES

__all__ = ["Conversation", "Piece"]

Piece = tuple[bytes, str]
"""Bytes that passed, and what they completed; ``incomplete`` when that was nothing yet."""


class Conversation:
    """Reads both directions of one line; bytes of any kind are taken.

    :param task: what is spoken, and what has to be known to read it.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._readers = task.readers()

    def pieces(self, direction: Direction, data: bytes) -> list[Piece]:
        """Return what passed at once in one direction, cut where its frames end."""
        reader = self._readers[direction]
        old = len(reader.pending)  # given out before, though the next events begin with it
        found: list[Piece] = []
        said: list[str] = []
        at = 0
        for event in reader.feed(data):
            said.append(self._words(event))
            new = max(0, len(event.raw) - old)
            old = max(0, old - len(event.raw))
            if new:
                found.append((data[at : at + new], "; ".join(said)))
                said = []
                at += new
        if at < len(data):
            said.append(_raw("incomplete", data[at:]))
            found.append((data[at:], "; ".join(said)))
        return found

    def _words(self, event: Event) -> str:
        decoded = self._task.found(event)
        if decoded is None:
            return _raw(EVENT_NAMES[type(event)], event.raw)
        return frame_line(self._task.protocol, frame_answer(decoded))


def _raw(kind: str, raw: bytes) -> str:
    """Name bytes that are no message; what is text all the same, as of a terminal, is shown."""
    text = raw.decode("latin-1")
    is_text = text.isascii() and text.rstrip("\r\n").isprintable() and text.strip()
    return f"{kind} {text!r}" if is_text else kind

"""The receiving side of a session: bytes are cut into events and counted, and half a frame is given up."""

from __future__ import annotations

from math import inf

from stagewire._codec.events import Event, Garbage
from stagewire._framings.header.frame import BadLength, Undocumented, Unknown
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End, Fault
from stagewire._sessions.statistics import Statistics

_MOST_ODD = 64
"""Kinds of frames that are no known message and are counted one by one; then all others together."""


class Receiver:
    """What is heard on one line.

    :param protocol: what is spoken.
    :param statistics: where it is counted.
    :param silence: seconds after which the rest of a frame will not come any more.
    """

    def __init__(self, protocol: FramedProtocol, statistics: Statistics, silence: float) -> None:
        self._framer = protocol.framer(End.HOST)
        self._statistics = statistics
        self._silence = silence
        self.tell = self._framer.tell
        self._forms = protocol.framing.forms
        self.counts: dict[int | str, int] = {}
        """Message -> how many of it have come."""
        self.odd_counts: dict[int | str, int] = {}
        """Words for a frame of an unknown message -> how many of them have come."""
        self.undecoded: dict[int | str, bytes] = {}
        """Message, or such words -> the bytes of the last one that came, of those without a layout."""
        self.faults: dict[int | str, Fault] = {}
        """Message -> what the last one that came reported, of those that report a fault."""
        self.heard = 0
        """Bytes that came."""
        self.silent_at = inf
        """When the rest of a frame will not come any more; inf: nothing is missing."""

    @property
    def is_within_a_frame(self) -> bool:
        """Whether the beginning of a frame has come, and its rest has not."""
        return self.silent_at != inf

    def feed(self, data: bytes, now: float) -> list[Event]:
        """Take bytes that came and return what they complete.

        Without bytes the line was silent until now, and a frame whose rest is overdue is given up. Bytes that
        are read after that time may have come before it, while the reader was held up. They are the rest of
        the frame, unless a message begins with them.
        """
        framer = self._framer
        events: list[Event] = []
        if now >= self.silent_at and (not data or framer.begins_message(data)):
            self.silent_at = inf
            self._statistics.silences += 1
            events = framer.abandon()
        if data:
            self.heard += len(data)
            events += framer.feed(data)
            self.silent_at = now + self._silence if framer.pending else inf
        return events

    def _note_odd(self, what: str, raw: bytes) -> None:
        if what not in self.odd_counts and len(self.odd_counts) >= _MOST_ODD:
            what = "other unknown messages"
        self.odd_counts[what] = self.odd_counts.get(what, 0) + 1
        self.undecoded[what] = raw

    def seen(self) -> dict[int | str, int]:
        """Return how many of everything have come, now."""
        return {**self.counts, **self.odd_counts}

    def count_odd(self, event: Event) -> None:
        """Count what is no message of a known layout."""
        match event:
            case Undocumented():
                self._statistics.undocumented += 1
                self.undecoded[event.id] = event.raw
            case Unknown():
                self._statistics.unknown += 1
                self._note_odd(f"unknown message {event.id:#06x}", event.raw)
            case BadLength():
                self._statistics.bad_length += 1
                self._note_odd(f"{self._forms[event.id].name} that is too short", event.raw)
            case Garbage():
                self._statistics.garbage += len(event.raw)

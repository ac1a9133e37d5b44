"""The receiving side of a session: cuts bytes into events, counts them, and gives up half frames."""

from __future__ import annotations

from math import inf

from stagewire._codec.events import Event, Garbage
from stagewire._framings.header.frame import (
    BadLength,
    Undocumented,
    Unknown,
    UnknownSubMessage,
)
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End, Fault
from stagewire._sessions.statistics import Statistics

_MOST_ODD = 64
"""Kinds of unknown frames that are counted separately; all others are counted together."""


class Receiver:
    """The receiving side of one line.

    :param protocol: the protocol of the line.
    :param statistics: counts the events.
    :param silence: seconds of silence after which an incomplete frame is given up.
    """

    def __init__(self, protocol: FramedProtocol, statistics: Statistics, silence: float) -> None:
        self._framer = protocol.framer(End.HOST)
        self._statistics = statistics
        self._silence = silence
        self.tell = self._framer.tell
        self._table = protocol.framing
        self.counts: dict[int | str, int] = {}
        """Message -> how many of it were received."""
        self.odd_counts: dict[int | str, int] = {}
        """Description of an unknown message -> how many of its frames were received."""
        self.undecoded: dict[int | str, bytes] = {}
        """Message without a layout, or such a description -> the bytes of the last one received."""
        self.faults: dict[int | str, Fault] = {}
        """Message that reports faults -> the fault in the last one received."""
        self.heard = 0
        """Number of bytes received."""
        self.silent_at = inf
        """When an incomplete frame is given up; inf: no frame is incomplete."""

    @property
    def is_within_a_frame(self) -> bool:
        """Whether only the beginning of a frame has arrived."""
        return self.silent_at != inf

    def feed(self, data: bytes, now: float) -> list[Event]:
        """Take received bytes and return the events that they complete.

        ``b""`` means that the line was silent until now; a frame whose rest is overdue is then given up.
        Bytes that are read after that time may have arrived earlier, while the reader was delayed. They count
        as the rest of the frame, unless a message begins with them.
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
        """Return the current count of each kind of message."""
        return {**self.counts, **self.odd_counts}

    def count_odd(self, event: Event) -> None:
        """Count an event that is not a message with a known layout."""
        match event:
            case Undocumented():
                self._statistics.undocumented += 1
                self.undecoded[event.id] = event.raw
            case UnknownSubMessage():
                self._statistics.unknown += 1
                what = f"unknown sub-message {event.sub_message} of {event.id:#06x}"
                self._note_odd(what, event.raw)
            case Unknown():
                self._statistics.unknown += 1
                self._note_odd(f"unknown message {event.id:#06x}", event.raw)
            case BadLength():
                self._statistics.bad_length += 1
                name = self._table.names[self._table.key_of(event.raw)]
                self._note_odd(f"{name} that is too short", event.raw)
            case Garbage():
                self._statistics.garbage += len(event.raw)

"""The bytes that come: cut into events, counted, and given up where the rest of a frame is missing."""

from __future__ import annotations

from math import inf

from stagewire.faults import Fault
from stagewire.framed import FramedProtocol
from stagewire.framing import BadLength, End, Event, Garbage, Undocumented, Unknown
from stagewire.session.statistics import Statistics

__all__ = ["Hearing"]


class Hearing:
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
        self.counts: dict[int, int] = {}
        """Message -> how many of it have come."""
        self.undocumented: dict[int, bytes] = {}
        """Message -> the bytes of the last one that came, of those without a layout."""
        self.faults: dict[int, Fault] = {}
        """Message -> what the last one that came reported, of those that report a fault."""
        self.heard = 0
        """Bytes that came."""
        self.silent_at = inf
        """When the rest of a frame will not come any more; inf: nothing is missing."""

    def feed(self, data: bytes, now: float) -> list[Event]:
        """Take bytes that came and return what they complete."""
        self.heard += len(data)
        events = self._framer.feed(data)
        self.silent_at = now + self._silence if self._framer.pending else inf
        return events

    def give_up(self, now: float) -> list[Event]:
        """Return what has come of a frame whose rest is overdue; nothing if none is."""
        if now < self.silent_at:
            return []
        self.silent_at = inf
        self._statistics.silences += 1
        return self._framer.abandon()

    def count_odd(self, event: Event) -> None:
        """Count what is no message of a known layout."""
        match event:
            case Undocumented():
                self._statistics.undocumented += 1
                self.undocumented[event.id] = event.raw
            case Unknown():
                self._statistics.unknown += 1
            case BadLength():
                self._statistics.bad_length += 1
            case Garbage():
                self._statistics.garbage += len(event.raw)

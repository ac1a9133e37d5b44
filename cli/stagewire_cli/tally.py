"""What came in, in numbers: the summary of ``stagewire decode``, and whether all of it was right."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from stagewire.framing import Event, Garbage
from stagewire_conformance.codec import EVENT_NAMES

__all__ = ["Tally"]

# An unknown message is none of these: newer controllers send more than is known.
_WRONG = ("refused", "garbage", "bad_length")


class Tally:
    """Counts frames, or the events of a stream."""

    def __init__(self) -> None:
        self.read = 0
        self.counts: Counter[str] = Counter()
        self._pending = 0
        self._in_garbage: dict[object, bool] = {}

    def frame(self, raw: bytes, right: bool) -> None:
        """Count a frame that had to be right."""
        self.read += len(raw)
        self.counts["frame" if right else "refused"] += 1

    def events(self, events: Sequence[Event], part: bytes, stream: object = None) -> None:
        """Count what a part of a stream gave; a run of garbage that blocks have cut counts once.

        ``stream`` tells streams apart, where there are several.
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
        """Count what is left at the end of a stream."""
        self._pending += len(pending)

    @property
    def right(self) -> bool:
        """Whether nothing was wrong."""
        return not self._pending and not any(self.counts[kind] for kind in _WRONG)

    @property
    def summary(self) -> str:
        """What came, in one line."""
        found = [f"{number} {kind}" for kind, number in sorted(self.counts.items())]
        found += [f"{self._pending} bytes incomplete"] * bool(self._pending)
        return f"{self.read} bytes: {', '.join(found) or 'nothing'}"

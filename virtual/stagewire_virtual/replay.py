"""The controller's side of a recorded session, played back in step with the requests.

So somebody's bug report becomes a test. What followed a request in the recording follows it now, after
the same time; of several requests that were under way, each is followed by its own answer. A host that
asks something else gets no answer, and the difference is noted, with the line of the recording.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Final

from stagewire.capture import Capture, read_capture
from stagewire.errors import CaptureError, UnknownProtocolError
from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.errors import ReplayError, UnknownPartError
from stagewire_virtual.framings import framing_of
from stagewire_virtual.instrument import Instrument, Row
from stagewire_virtual.recording import Requests, Step, loose_ends, share_out, steps_of, unit_of

_REMEMBERED: Final = 1000  # differences; the others are counted
_SHOWN: Final = 10  # of them in a summary
_WIDTH: Final = 32  # bytes of a request


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A request that is not the one that was recorded.

    :param line: where the recording has another one; None behind its end.
    :param expected: the request that was recorded, in words; None behind the end.
    :param got: the request that came, in words.
    """

    line: int | None
    expected: str | None
    got: str

    def __str__(self) -> str:
        if self.line is None:
            return f"behind the end of the recording: got {self.got}"
        return f"line {self.line}: expected {self.expected}, got {self.got}"


class Replay(Instrument):
    """What was recorded of a controller; it is served like any other.

    Requests are compared frame by frame, however the host cuts its bytes; what is no request is said in
    :class:`~stagewire_virtual.recording.Requests`. What is still to be said keeps its order.

    A strict replay, the default, waits for the request that was recorded, whatever else comes. A lenient
    one looks for the same request further on in the recording, and goes on from there; what it skips
    counts as missing.

    :param capture: the recording.
    :param clock: the time.
    :param lenient: whether requests may be left out.

    Raises :class:`~stagewire.errors.UnknownProtocolError` for a recording of a protocol that is not
    installed.
    """

    def __init__(self, capture: Capture, clock: Clock, *, lenient: bool = False) -> None:
        super().__init__(unit_of(capture.heading), clock)
        self._lenient = lenient
        self._framing = framing_of(self.unit.protocol)
        self._steps = steps_of(capture, self.unit)
        share_out(self._steps, self.unit)
        self._loose_ends = loose_ends(capture, self.unit)
        self._requests = Requests(self.unit, clock, self._take)
        self._timer: Timer | None = None
        self.power_cycle()

    def power_cycle(self) -> None:
        """Begin again at the beginning of the recording."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None
        self._requests.clear()
        # What is still to be said, the first of the recording first: its place there, when, the bytes.
        self._due: list[tuple[int, int, bytes]] = []
        self._next = 0  # the step that is waited for; 0 is what was said before any request
        self._skipped: list[Step] = []
        self._differences = 0
        self.mismatches: list[Mismatch] = []
        """The requests that were not those of the recording; the first thousand of them."""

    def host_came(self) -> None:
        """Hear that a host has come: what was recorded before any request is said now."""
        if not self._next:
            self._play(0)

    def receive(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        self._requests.receive(data)

    def rows(self) -> Sequence[Row]:
        """Return what the live table shows."""
        due = max(self._next, 1)
        waits = (
            f"waits for line {self._steps[due].line}" if due < len(self._steps) else "at its end"
        )
        return [Row("replay", f"{self.seen} of {self.requests} requests", waits)]

    def stick(self, part: str, stuck: bool) -> None:
        """Refuse: raises :class:`~stagewire_virtual.errors.UnknownPartError`."""
        raise UnknownPartError(f"{part} in a recording that could stick", [])

    # How it went

    @property
    def requests(self) -> int:
        """How many requests were recorded."""
        return len(self._steps) - 1

    @property
    def seen(self) -> int:
        """How many of them have come."""
        return max(self._next - 1, 0) - len(self._skipped)

    @property
    def missing(self) -> list[str]:
        """The requests that have not come, in words."""
        return list(self._missing())

    @property
    def ok(self) -> bool:
        """Whether all requests came as they were recorded, and no others."""
        return not self._differences and self.seen == self.requests

    @property
    def summary(self) -> str:
        """How it went, for people: one line, one for each of the first differences, and what is cut off."""
        lines = [f"{self.seen} of {self.requests} requests came as they were recorded"]
        for what, count, found in (
            ("not due", self._differences, map(str, self.mismatches)),
            ("missing", self.requests - self.seen, self._missing()),
        ):
            if count:
                lines.append(f"{count} {what}:")
                lines += [f"  {line}" for line in islice(found, _SHOWN)]
                lines += ["  …"] * (count > _SHOWN)
        return "\n".join(lines + self._loose_ends)

    def check(self) -> None:
        """Raise :class:`~stagewire_virtual.errors.ReplayError` with the summary unless all is well."""
        if not self.ok:
            raise ReplayError(self.summary)

    def _missing(self) -> Iterator[str]:
        left = islice(self._steps, max(self._next, 1), None)
        for step in chain(self._skipped, left):
            yield f"line {step.line}: {self._words(step.request)}"

    # In step

    def _take(self, request: bytes) -> None:
        """Answer a request as it was answered, or note that it is another one."""
        self.host_came()  # if nobody has said so
        steps, place = self._steps, self._next
        if place < len(steps) and steps[place].request == request:
            self._play(place)
            return
        self._differ(request)
        if self._lenient:
            ahead = range(place, len(steps))
            found = next((at for at in ahead if steps[at].request == request), None)
            if found is not None:
                self._skipped += steps[place:found]
                self._play(found)

    def _differ(self, request: bytes) -> None:
        """Note a request that is not the one that is due."""
        self._differences += 1
        if len(self.mismatches) == _REMEMBERED:
            return
        line = expected = None
        if self._next < len(self._steps):
            step = self._steps[self._next]
            line, expected = step.line, self._words(step.request)
        self.mismatches.append(Mismatch(line, expected, self._words(request)))

    def _play(self, place: int) -> None:
        """Say what followed a step, each in its time, behind what was said before it in the recording."""
        self._next = place + 1
        for said in self._steps[place].said:
            heapq.heappush(self._due, (said.place, self.clock.now + said.delay, said.data))
        self._say()

    def _say(self) -> None:
        """Say what is due, and wait for what is due next."""
        while self._due and self._due[0][1] <= self.clock.now:
            self.on_send(heapq.heappop(self._due)[2])
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self.clock.call_at(self._due[0][1], self._say) if self._due else None

    def _words(self, request: bytes) -> str:
        """Name a request, for people."""
        if self._framing.is_text(request):
            return repr(request[:_WIDTH].decode("latin-1"))
        name = self._framing.message_name(request) or "unknown"
        return f"{name} ({request[:_WIDTH].hex(' ')}{' …' if len(request) > _WIDTH else ''})"


def load_replay(path: Path | str, clock: Clock, *, lenient: bool = False) -> Replay:
    """Return the replay of a capture in a file.

    Raises :class:`~stagewire.errors.CaptureError` for what is none, and for one of a protocol that is not
    installed, and :class:`OSError` for a file that cannot be read.
    """
    try:
        return Replay(read_capture(path), clock, lenient=lenient)
    except UnknownProtocolError as error:
        raise CaptureError(1, str(error), path) from None

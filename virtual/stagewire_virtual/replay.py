"""Play back the controller's side of a recorded session, in step with the requests of the host.

A replay turns a bug report into a test. Each request gets the answer that it got in the recording, after the
same time. If several requests were sent before the first answer, each still gets its own. A request that
differs from the recorded one gets no answer; the difference is noted with the line of the recording.
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

_REMEMBERED: Final = 1000  # differences that are kept; further ones are only counted
_SHOWN: Final = 10  # differences in a summary
_WIDTH: Final = 32  # bytes of a request in a message


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A request that differs from the recorded one.

    :param line: the line of the recorded request; None after the end of the recording.
    :param expected: a description of the recorded request; None after the end.
    :param got: a description of the request that was received.
    """

    line: int | None
    expected: str | None
    got: str

    def __str__(self) -> str:
        if self.line is None:
            return f"after the end of the recording: got {self.got}"
        return f"line {self.line}: expected {self.expected}, got {self.got}"


class Replay(Instrument):
    """A controller that plays back a recording; it can be served like any other.

    Requests are compared frame by frame, in whatever chunks they arrive;
    :class:`~stagewire_virtual.recording.Requests` defines which bytes count. Answers that are still due keep
    the order of the recording.

    A strict replay, the default, waits for the next recorded request and ignores all others. A lenient replay
    searches the rest of the recording for the same request and continues there; the requests that it skips
    count as missing.

    :param capture: the recording.
    :param clock: the clock.
    :param lenient: whether recorded requests may be skipped.

    Raises :class:`~stagewire.errors.UnknownProtocolError` if the protocol of the recording is not installed.
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
        """Return to the beginning of the recording."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None
        self._requests.clear()
        # Bytes that are still to be sent, in the order of the recording: position there, instant, bytes.
        self._due: list[tuple[int, int, bytes]] = []
        self._next = 0  # the next step; step 0 has the bytes that were sent before any request
        self._skipped: list[Step] = []
        self._differences = 0
        self.mismatches: list[Mismatch] = []
        """The first thousand requests that differed from the recording."""

    def host_came(self) -> None:
        """Note that a host has connected, and send what was recorded before the first request."""
        if not self._next:
            self._play(0)

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        self._requests.receive(data)

    def rows(self) -> Sequence[Row]:
        """Return the rows of the live table."""
        due = max(self._next, 1)
        waits = (
            f"waits for line {self._steps[due].line}" if due < len(self._steps) else "at the end"
        )
        return [Row("replay", f"{self.seen} of {self.requests} requests", waits)]

    def stick(self, part: str, stuck: bool) -> None:
        """Raise :class:`~stagewire_virtual.errors.UnknownPartError`: a recording has no axes."""
        raise UnknownPartError(f"{part} in a recording", [])

    # Results

    @property
    def requests(self) -> int:
        """The number of recorded requests."""
        return len(self._steps) - 1

    @property
    def seen(self) -> int:
        """The number of recorded requests that have been received."""
        return max(self._next - 1, 0) - len(self._skipped)

    @property
    def missing(self) -> list[str]:
        """Descriptions of the recorded requests that have not been received."""
        return list(self._missing())

    @property
    def ok(self) -> bool:
        """Whether exactly the recorded requests were received."""
        return not self._differences and self.seen == self.requests

    @property
    def summary(self) -> str:
        """The result for people: totals, the first differences, and incomplete frames at the end."""
        lines = [f"{self.seen} of {self.requests} recorded requests were received"]
        for what, count, found in (
            ("different", self._differences, map(str, self.mismatches)),
            ("missing", self.requests - self.seen, self._missing()),
        ):
            if count:
                lines.append(f"{count} {what}:")
                lines += [f"  {line}" for line in islice(found, _SHOWN)]
                lines += ["  …"] * (count > _SHOWN)
        return "\n".join(lines + self._loose_ends)

    def check(self) -> None:
        """Raise :class:`~stagewire_virtual.errors.ReplayError` with the summary unless :attr:`ok`."""
        if not self.ok:
            raise ReplayError(self.summary)

    def _missing(self) -> Iterator[str]:
        left = islice(self._steps, max(self._next, 1), None)
        for step in chain(self._skipped, left):
            yield f"line {step.line}: {self._words(step.request)}"

    # Playing back

    def _take(self, request: bytes) -> None:
        """Answer a request as recorded, or note that it differs."""
        self.host_came()  # has no effect if it has been called before
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
        """Note a request that differs from the next recorded one."""
        self._differences += 1
        if len(self.mismatches) == _REMEMBERED:
            return
        line = expected = None
        if self._next < len(self._steps):
            step = self._steps[self._next]
            line, expected = step.line, self._words(step.request)
        self.mismatches.append(Mismatch(line, expected, self._words(request)))

    def _play(self, place: int) -> None:
        """Send the answers of a step, each after its delay and after all earlier ones of the recording."""
        self._next = place + 1
        for said in self._steps[place].said:
            heapq.heappush(self._due, (said.place, self.clock.now + said.delay, said.data))
        self._say()

    def _say(self) -> None:
        """Send the bytes that are due, and set the timer for the next ones."""
        while self._due and self._due[0][1] <= self.clock.now:
            self.on_send(heapq.heappop(self._due)[2])
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self.clock.call_at(self._due[0][1], self._say) if self._due else None

    def _words(self, request: bytes) -> str:
        """Return a description of a request for people."""
        if self._framing.is_text(request):
            return repr(request[:_WIDTH].decode("latin-1"))
        name = self._framing.message_name(request) or "unknown"
        return f"{name} ({request[:_WIDTH].hex(' ')}{' …' if len(request) > _WIDTH else ''})"


def load_replay(path: Path | str, clock: Clock, *, lenient: bool = False) -> Replay:
    """Return the replay of a capture file.

    Raises :class:`~stagewire.errors.CaptureError` if the file is not a capture or its protocol is not
    installed, and :class:`OSError` if it cannot be read.
    """
    try:
        return Replay(read_capture(path), clock, lenient=lenient)
    except UnknownProtocolError as error:
        raise CaptureError(1, str(error), path) from None

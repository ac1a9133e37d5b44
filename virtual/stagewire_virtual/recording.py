"""A recorded session as a list of steps: a request of the host, and the controller's answers to it.

Hosts may send several requests before the first is answered. :func:`share_out` then uses the framing and the
registry to find the request that each answer belongs to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from stagewire.capture import Capture, Heading
from stagewire.framing import Event, Garbage
from stagewire.protocols import Direction, load_protocol
from stagewire_virtual.clock import Clock, SteppedClock
from stagewire_virtual.framings import framing_of
from stagewire_virtual.framings.framing import RequestReader
from stagewire_virtual.instrument import Unit, units_of


class RecordedReply(NamedTuple):
    """Bytes from the controller.

    :param place: the position of their first byte in everything that the controller sent.
    :param delay: the time since the request, in nanoseconds.
    :param data: the bytes.
    """

    place: int
    delay: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Step:
    """A request and its answers.

    :param request: the bytes of its frame; empty for the step before the first request.
    :param line: its line in the recording.
    :param time: its instant, in nanoseconds since the recording began.
    :param said: the answers of the controller.
    """

    request: bytes
    line: int
    time: int
    said: list[RecordedReply] = field(default_factory=list)


class Requests:
    """Cuts the bytes of a host into requests, in whatever chunks they arrive.

    A request is a frame or, for a controller that accepts text, a line of text. Keep-alive messages, whose
    times depend on a clock of the host, and bytes outside a frame do not count.

    :param unit: the unit that the host talks to.
    :param clock: the clock.
    :param take: called with each request.
    """

    def __init__(self, unit: Unit, clock: Clock, take: Callable[[bytes], None]) -> None:
        self._framing = framing_of(unit.protocol)
        self._reader = RequestReader(self._framing, clock, self._read)
        self._take = take
        self._keep_alive = frozenset(
            entry["name"]
            for entry in unit.registry["messages"]
            if (entry.get("exchange") or {}).get("keeps_alive")
        )

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        self._reader.feed(data)

    def clear(self) -> None:
        """Discard an incomplete request."""
        self._reader.clear()

    def _read(self, event: Event) -> None:
        if isinstance(event, Garbage):
            return
        if self._framing.message_name(event.raw) not in self._keep_alive:
            self._take(event.raw)


def steps_of(capture: Capture, unit: Unit) -> list[Step]:
    """Return the steps of a recording; the first step has no request and begins with the first line.

    Each answer is in the step of the last request before it; :func:`share_out` moves it to the request that
    it answers.
    """
    clock = SteppedClock()  # set to the times of the recording
    line = place = 0
    steps: list[Step] = []

    def take(request: bytes) -> None:
        steps.append(Step(request, line, clock.now))

    requests = Requests(unit, clock, take)
    for recorded in capture.recorded:
        clock.run_until(recorded.time)
        if not steps:
            steps.append(Step(b"", recorded.line, recorded.time))
        if recorded.direction is Direction.TO_HOST:
            step = steps[-1]
            step.said.append(RecordedReply(place, recorded.time - step.time, recorded.data))
            place += len(recorded.data)
        else:
            line = recorded.line
            requests.receive(recorded.data)
    return steps or [Step(b"", 0, 0)]


def loose_ends(capture: Capture, unit: Unit) -> list[str]:
    """Return a sentence for each direction that ends in the middle of a frame, as in a truncated file.

    This cannot be detected for replies without a frame.
    """
    clock, framing = SteppedClock(), framing_of(unit.protocol)
    host = RequestReader(framing, clock, lambda event: None)
    controller = framing.reply_framer()
    last: dict[Direction, int] = {}
    for recorded in capture.recorded:
        clock.run_until(recorded.time)
        last[recorded.direction] = recorded.line
        if recorded.direction is Direction.TO_CONTROLLER:
            host.feed(recorded.data)
        elif controller is not None:
            controller.feed(recorded.data)
    rests = (
        (Direction.TO_CONTROLLER, host.pending, "a request, which is left out"),
        (
            Direction.TO_HOST,
            controller.pending if controller else b"",
            "an answer, sent as recorded",
        ),
    )
    return [
        f"line {last[direction]}: the recording ends in the middle of {what} ({rest[:8].hex(' ')} …)"
        for direction, rest, what in rests
        if rest
    ]


def unit_of(heading: Heading) -> Unit:
    """Return the unit of a recording; for a unit that is not in the registry, a new one with all messages.

    Raises :class:`~stagewire.errors.UnknownProtocolError` if its protocol is not installed.
    """
    protocol = load_protocol(heading.protocol)
    name = heading.unit or "recorded"
    known = units_of(protocol)
    if name in known:
        return known[name]
    registry = protocol.registry()
    messages = [entry["name"] for entry in registry["messages"]]
    return Unit(name, protocol, {"name": name, "messages": messages}, {}, registry)


def share_out(steps: Sequence[Step], unit: Unit) -> None:
    """Move each answer to the step of its request, where several requests came before the first answer.

    The search starts at the end: the last answer belongs to the last request that it can answer. A request
    that was repeated because it got no answer therefore stays without one. Bytes that answer no request stay
    with the last request.
    """
    burst: list[Step] = []
    for step in steps[1:]:  # the first step has no request
        burst.append(step)
        if step.said:
            if len(burst) > 1:
                _share(burst, unit)
            burst = []


def _share(burst: Sequence[Step], unit: Unit) -> None:
    last = burst[-1]
    said = last.said.copy()
    last.said.clear()
    whole = b"".join(data for _, _, data in said)
    found = framing_of(unit.protocol).shares([step.request for step in burst], whole, unit)
    shares = iter([*((size, burst[index]) for size, index in reversed(found)), (len(whole), last)])
    left, owner = next(shares)
    for place, delay, data in said:
        when, at = last.time + delay, 0
        while at < len(data):
            while not left:
                left, owner = next(shares)
            size = min(left, len(data) - at)
            owner.said.append(RecordedReply(place + at, when - owner.time, data[at : at + size]))
            at, left = at + size, left - size

"""A recorded session as steps: each request of the host, and what the controller said until the next.

Hosts send several requests before the first is answered. Then the framing and the registry say which of them
an answer belongs to (:func:`share_out`).
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
    """Bytes that the controller said.

    :param place: of their first byte, among all that it said.
    :param delay: how long after the request, in nanoseconds.
    :param data: the bytes.
    """

    place: int
    delay: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Step:
    """A request, and what followed it.

    :param request: the bytes of its frame; none for what came before any request.
    :param line: where it stands in the recording.
    :param time: when it came, in nanoseconds since the recording began.
    :param said: what the controller said to it.
    """

    request: bytes
    line: int
    time: int
    said: list[RecordedReply] = field(default_factory=list)


class Requests:
    """Cuts what a host sends into requests, however its bytes come.

    A line of text, of a controller that takes text, too, is a request like a frame.
    Acknowledgements that keep a controller talking come when a clock of the host says so; they are no
    requests, and neither are bytes that belong to no frame.

    :param unit: whose host it is.
    :param clock: the time.
    :param take: takes each request.
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
        """Take what the host sends, cut at any byte."""
        self._reader.feed(data)

    def clear(self) -> None:
        """Forget what has come of a request."""
        self._reader.clear()

    def _read(self, event: Event) -> None:
        if isinstance(event, Garbage):
            return
        if self._framing.message_name(event.raw) not in self._keep_alive:
            self._take(event.raw)


def steps_of(capture: Capture, unit: Unit) -> list[Step]:
    """Return the steps of a recording; the first one, without a request, begins with the first line.

    What the controller said stands with the last request before it. Who wants it with the request that it
    answers calls :func:`share_out`.
    """
    clock = SteppedClock()  # on which the recording happens again
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
    """Return a sentence for each direction that ends in the midst of a frame, as in a file that was cut off.

    Replies without a frame do not show it.
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
        (Direction.TO_HOST, controller.pending if controller else b"", "an answer, which stays so"),
    )
    return [
        f"line {last[direction]}: the recording ends in the midst of {what} ({rest[:8].hex(' ')} …)"
        for direction, rest, what in rests
        if rest
    ]


def unit_of(heading: Heading) -> Unit:
    """Return the unit of a recording; one that the registry has not stands for itself, with all messages.

    Raises :class:`~stagewire.errors.UnknownProtocolError` for a protocol that is not installed.
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
    """Move what answers a request to it, where more requests came before the answer.

    It is told from the end: the last answer belongs to the last request that it can answer, so that one
    which was never answered, and asked again, stays without. What answers none stays with the last.
    """
    burst: list[Step] = []
    for step in steps[1:]:  # nobody asked for what the first one has
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

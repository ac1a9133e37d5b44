"""A recorded session as steps: each request of the host, and what the controller said until the next."""

from __future__ import annotations

from dataclasses import dataclass, field

from stagewire.capture import Capture, Heading
from stagewire.direction import Direction
from stagewire.framing import Event, Garbage
from stagewire.protocol import load_protocol
from stagewire_virtual.cutting import cutter_of, message_name
from stagewire_virtual.units import Unit, units_of

__all__ = ["Requests", "Step", "steps_of", "unit_of"]


@dataclass(frozen=True, slots=True)
class Step:
    """A request, and what followed it.

    :param request: the bytes of its frame; none for what came before any request.
    :param line: where it stands in the recording.
    :param time: when it came, in nanoseconds since the recording began.
    :param said: what the controller said then, each with its delay in nanoseconds.
    """

    request: bytes
    line: int
    time: int
    said: list[tuple[int, bytes]] = field(default_factory=list)


class Requests:
    """Cuts what a host sends into requests, however its bytes come.

    Acknowledgements that keep a controller talking come when a clock of the host says so; they are no
    requests, and neither are bytes that belong to no frame.
    """

    def __init__(self, unit: Unit) -> None:
        self._protocol = unit.protocol
        self._cutter = cutter_of(unit.protocol)
        self._keep_alive = frozenset(
            entry["name"]
            for entry in unit.registry["messages"]
            if (entry.get("exchange") or {}).get("keeps_alive")
        )

    def feed(self, data: bytes) -> list[bytes]:
        """Take the next bytes and return the requests that they complete."""
        return [event.raw for event in self._cutter.feed(data) if self._is_request(event)]

    def _is_request(self, event: Event) -> bool:
        if isinstance(event, Garbage):
            return False
        return message_name(self._protocol, event.raw) not in self._keep_alive


def steps_of(capture: Capture, unit: Unit) -> list[Step]:
    """Return the steps of a recording; the first one, without a request, begins with the first line."""
    first = capture.recorded[0] if capture.recorded else None
    steps = [Step(b"", first.line, first.time) if first else Step(b"", 0, 0)]
    requests = Requests(unit)
    for recorded in capture.recorded:
        if recorded.direction is Direction.TO_HOST:
            steps[-1].said.append((recorded.time - steps[-1].time, recorded.data))
        else:
            cut = requests.feed(recorded.data)
            steps += [Step(request, recorded.line, recorded.time) for request in cut]
    return steps


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

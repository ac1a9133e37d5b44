"""Which of several requests a recorded answer belongs to.

Hosts send several requests before the first is answered. Then the registry says what answers what: the
message of a frame, or the length of a reply that has no frame. A line of text is answered by a line.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

from stagewire.errors import CodecError
from stagewire.framing import End
from stagewire.protocols import CommandProtocol, Frame, FramedProtocol
from stagewire_virtual.instrument import Unit
from stagewire_virtual.listening import is_text
from stagewire_virtual.recording import Said, Step

_Share: TypeAlias = tuple[int, Step]
"""How many of the bytes that were said belong to which request."""


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
    shares = _shares(burst, b"".join(data for _, _, data in said), unit)
    left, owner = next(shares)
    for place, delay, data in said:
        when, at = last.time + delay, 0
        while at < len(data):
            while not left:
                left, owner = next(shares)
            size = min(left, len(data) - at)
            owner.said.append(Said(place + at, when - owner.time, data[at : at + size]))
            at, left = at + size, left - size


def _shares(burst: Sequence[Step], data: bytes, unit: Unit) -> Iterator[_Share]:
    """Yield whose the bytes are, from the first to the last."""
    found: list[_Share] = []
    if isinstance(unit.protocol, FramedProtocol):
        found = _by_message(burst, data, unit, unit.protocol)
    elif isinstance(unit.protocol, CommandProtocol):
        found = _by_length(burst, data, unit.protocol)
    yield from reversed(found)
    yield len(data), burst[-1]


def _by_message(
    burst: Sequence[Step], data: bytes, unit: Unit, protocol: FramedProtocol
) -> list[_Share]:
    """Share frames out, the last first: an answer comes from where the request went, and has its name."""
    unanswered: dict[tuple[str, int], list[Step]] = {}
    for step in burst:
        if (asked := _decoded(protocol, step.request)) is not None:
            exchange = unit.message(asked.message.layout.message).get("exchange") or {}
            for name in exchange.get("answered_by", ()):
                unanswered.setdefault((name, asked.dest), []).append(step)
    found: list[_Share] = []
    for event in reversed(protocol.framer(End.HOST).feed(data)):
        owner = burst[-1]
        if (said := _decoded(protocol, event.raw)) is not None:
            waiting = unanswered.get((said.message.layout.message, said.source))
            owner = waiting.pop() if waiting else owner
        found.append((len(event.raw), owner))
    return found


def _by_length(burst: Sequence[Step], data: bytes, protocol: CommandProtocol) -> list[_Share]:
    """Share bytes without a frame out, the last first, as far as they suffice for whole replies."""
    found: list[_Share] = []
    size = len(data)
    for step in reversed(burst):
        if is_text(protocol, step.request):
            length = _last_line(data[:size]) if step.request.strip() else 0
        else:
            length = _reply_length(protocol, step.request)
        if length > size:
            break
        found.append((length, step))
        size -= length
    return [*found, (size, burst[-1])]


def _decoded(protocol: FramedProtocol, raw: bytes) -> Frame | None:
    try:
        return protocol.decode(raw)
    except CodecError:
        return None  # what nobody knows answers nothing


def _last_line(data: bytes) -> int:
    """Return the length of the line that bytes end with, 0 for none."""
    return len(data) - data.rfind(b"\n", 0, -1) - 1 if data.endswith(b"\n") else 0


def _reply_length(protocol: CommandProtocol, raw: bytes) -> int:
    try:
        reply = protocol.decode(raw).message.reply
    except CodecError:
        return 0
    return 0 if reply is None else reply.layout.length

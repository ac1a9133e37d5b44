"""The faults of one direction of a link.

Bytes travel as a :class:`Chunk`. An :class:`Effect` applies one fault: it selects pieces by the rule and
changes them according to the action. A :class:`FaultChain` sends chunks through all effects of its direction
in order, and holds delayed chunks until they are due.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat
from random import Random
from typing import Final

from stagewire_virtual.clock import Clock, Timer, nanoseconds
from stagewire_virtual.faults.fault import Action, Fault, Piece

MOST_HELD: Final = 1 << 16
"""The number of bytes that one direction can hold back; further bytes are lost."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes that travel together.

    :param data: the bytes.
    :param is_frame: whether they were sent as one whole frame; damage does not change that.
    :param message: the name of its message, if a fault needs it.
    :param delay: its delay in nanoseconds.
    :param overtaken: whether later chunks may arrive before it.
    :param cut: whether this chunk, which has no bytes, cuts the line.
    """

    data: bytes
    is_frame: bool = False
    message: str | None = None
    delay: int = 0
    overtaken: bool = False
    cut: bool = False


def bytes_of(chunk: Chunk) -> Iterator[Chunk]:
    """Yield each byte of a chunk as a chunk."""
    data = chunk.data
    for at in range(len(data)):
        yield replace(chunk, data=data[at : at + 1])


def joined(parts: Iterable[Chunk]) -> Iterator[Chunk]:
    """Join the parts of a chunk that still travel together; the first result remains the frame."""
    run: Chunk | None = None
    data = bytearray()
    for part in parts:
        if run is not None and _travel_together(run, part) and len(data) < MOST_HELD:
            data += part.data
            continue
        if run is not None:
            yield replace(run, data=bytes(data))
            part = replace(part, is_frame=False)
        run, data = part, bytearray(part.data)
    if run is not None:
        yield replace(run, data=bytes(data))


def _travel_together(one: Chunk, next: Chunk) -> bool:
    return (one.delay, one.overtaken, one.cut) == (next.delay, next.overtaken, next.cut)


_SHOWN: Final = 16  # bytes shown of a piece in a report


class Effect:
    """Applies one fault of a direction.

    :param fault: the fault.
    :param chance: its own random stream.
    :param report: called with a description of each piece that was hit.
    :param flood: begins the flood, if the fault is one.
    """

    def __init__(
        self,
        fault: Fault,
        chance: Random,
        report: Callable[[Fault, str], None],
        flood: Callable[[], None],
    ) -> None:
        self._fault = fault
        self._chance = chance
        self._report = report
        self._flood = flood
        self._count = 0

    def apply(self, chunk: Chunk) -> Iterable[Chunk]:
        """Return the chunks that replace a chunk, lazily, because a fault may make very many."""
        if not chunk.data or self._fault.message not in (None, chunk.message):
            return [chunk]
        if self._fault.piece is Piece.FRAME:
            return self._passed(chunk) if chunk.is_frame else [chunk]
        return joined(self._bytes_passed(chunk))

    def _bytes_passed(self, chunk: Chunk) -> Iterator[Chunk]:
        """Yield the chunks that replace the bytes of a chunk, until one cuts the line."""
        for byte in bytes_of(chunk):
            for part in self._passed(byte):
                yield part
                if part.cut:
                    return

    def _passed(self, piece: Chunk) -> Iterable[Chunk]:
        """Return the chunks that replace one piece."""
        self._count += 1
        if not self._hits():
            return [piece]
        fault = self._fault
        shown = piece.data[:_SHOWN].hex(" ") + (" …" if len(piece.data) > _SHOWN else "")
        assert fault.piece is not None  # only a fault without direction counts no pieces
        self._report(fault, f"{fault.piece.value} {self._count}: {shown}")
        if fault.action is Action.FLOOD:
            self._flood()
        return _BECOMES[fault.action](piece, fault, self._chance)

    def _hits(self) -> bool:
        """Return whether the rule selects the piece that was counted last."""
        fault = self._fault
        if fault.at is not None:
            return self._count == fault.at
        if fault.p is not None:
            return self._chance.random() < fault.p
        return self._count % (fault.every or 1) == 0


def _drop(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    return []


def _insert(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    data = chance.randbytes(1) if fault.data is None else fault.data
    return [replace(piece, data=data), piece]


def _flip(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    bits = 8 * len(piece.data)
    bit = chance.randrange(bits) if fault.bit is None else fault.bit % bits
    data = bytearray(piece.data)
    data[bit // 8] ^= 1 << bit % 8
    return [replace(piece, data=bytes(data))]


def _delay(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    late = piece.delay + nanoseconds(fault.by or 0)
    return [replace(piece, delay=late, overtaken=piece.overtaken or bool(fault.overtaken))]


def _duplicate(piece: Chunk, fault: Fault, chance: Random) -> Iterable[Chunk]:
    return repeat(piece, 1 + (fault.count or 1))


def _flood(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    return [piece]  # the flood follows it


def _disconnect(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    """Cut the line after a byte, or in the middle of a frame."""
    half = len(piece.data) // 2
    data = piece.data if fault.piece is Piece.BYTE else piece.data[:half]
    return [replace(piece, data=data), replace(piece, data=b"", is_frame=False, cut=True)]


_BECOMES: Final[Mapping[Action, Callable[[Chunk, Fault, Random], Iterable[Chunk]]]] = {
    Action.DROP: _drop,
    Action.INSERT: _insert,
    Action.FLIP: _flip,
    Action.DELAY: _delay,
    Action.DUPLICATE: _duplicate,
    Action.FLOOD: _flood,
    Action.DISCONNECT: _disconnect,
}
"""The function of each action; it returns the chunks that replace a selected piece."""


class FaultChain:
    """Sends chunks through the faults of a direction and delivers the results when they are due.

    A delayed chunk holds up the following ones, as on a serial line, unless it may be overtaken.

    :param clock: the clock.
    :param hand_on: called with each chunk that arrives; it may call :meth:`clear`.
    :param lost: called with a message when bytes are lost because the limit is reached.
    """

    def __init__(
        self,
        clock: Clock,
        hand_on: Callable[[Chunk], None],
        lost: Callable[[str], None],
    ) -> None:
        self.effects: Sequence[Effect] = ()
        self._clock = clock
        self._hand_on = hand_on
        self._lost = lost
        self._timer: Timer | None = None
        self._count = 0  # chunks with the same instant arrive in the order in which they were sent
        self._latest = 0  # the instant at which the last chunk that holds up others arrives
        self.clear()

    def clear(self) -> None:
        """Discard all delayed chunks, because the line was cut."""
        self._late: list[tuple[int, int, Chunk]] = []
        self._held = 0
        self._in_order = 0  # late chunks that hold up others
        self._set_timer()

    def take(self, chunk: Chunk) -> None:
        """Send a chunk through the faults."""
        chunks = [chunk]
        for effect in self.effects:
            chunks = list(
                self._within(len(chunk.data), chain.from_iterable(map(effect.apply, chunks)))
            )
        for one in chunks:
            self.send(one)

    def _within(self, size: int, chunks: Iterable[Chunk]) -> Iterator[Chunk]:
        """Yield the chunks that replace ``size`` bytes, until one cuts the line or the limit is reached."""
        room = size + MOST_HELD
        for chunk in chunks:
            room -= len(chunk.data)
            if room < 0:
                self._lost(f"faults added over {MOST_HELD} bytes to {size}; the rest is lost")
                return
            yield chunk
            if chunk.cut:
                return

    def send(self, chunk: Chunk) -> None:
        """Send a chunk past the faults."""
        if not chunk.delay and not self._in_order:
            self._hand_on(chunk)
            return
        if self._held + len(chunk.data) > MOST_HELD:
            self._lost(f"over {MOST_HELD} bytes are held back; {len(chunk.data)} more are lost")
            return
        due = self._clock.now + chunk.delay
        if not chunk.overtaken:
            if self._in_order:
                due = max(due, self._latest)
            self._latest = due
            self._in_order += 1
        self._count += 1
        self._held += len(chunk.data)
        heapq.heappush(self._late, (due, self._count, chunk))
        self._set_timer()

    def _set_timer(self) -> None:
        """Set the one timer to the next chunk that is due."""
        due = self._late[0][0] if self._late else None
        if self._timer is not None:
            if self._timer.when == due:
                return
            self._timer.cancel()
        self._timer = None if due is None else self._clock.call_at(due, self._arrive)

    def _arrive(self) -> None:
        """Deliver the chunks that are due."""
        self._timer = None
        while self._late and self._late[0][0] <= self._clock.now:
            chunk = heapq.heappop(self._late)[2]
            self._held -= len(chunk.data)
            self._in_order -= not chunk.overtaken
            self._hand_on(chunk)
        self._set_timer()

"""One direction of a link: bytes on their way through its faults, in their order, and what is late.

Bytes travel as a :class:`Chunk`. An :class:`Effect` is a fault at work: it chooses the pieces that its rule
hits, and makes of them what its action says. A :class:`FaultChain` sends chunks through all effects of its
direction, and keeps those that are late until they are due.
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
"""Bytes that one direction holds back; what comes beyond that is lost."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes that travel together.

    :param data: the bytes.
    :param is_frame: whether they were sent as one whole frame; it stays one when bytes in it are damaged.
    :param message: name of its message, where somebody asks for it.
    :param delay: nanoseconds by which it is late.
    :param overtaken: whether what follows may be there before it.
    :param cut: of a chunk without bytes: it cuts the line.
    """

    data: bytes
    is_frame: bool = False
    message: str | None = None
    delay: int = 0
    overtaken: bool = False
    cut: bool = False


def bytes_of(chunk: Chunk) -> Iterator[Chunk]:
    """Yield every byte of a chunk by itself."""
    data = chunk.data
    for at in range(len(data)):
        yield replace(chunk, data=data[at : at + 1])


def joined(parts: Iterable[Chunk]) -> Iterator[Chunk]:
    """Yield parts of one chunk, those joined that still travel together; the first one is the frame."""
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


_SHOWN: Final = 16  # bytes of a piece in a report


class Effect:
    """What one fault does among those of a direction.

    :param fault: what goes wrong.
    :param chance: its own stream of chance.
    :param report: told which piece was hit.
    :param flood: begins the flood, of a fault that is one.
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
        """Return what becomes of a chunk, made as it is asked for: a fault may make very much of it."""
        if not chunk.data or self._fault.message not in (None, chunk.message):
            return [chunk]
        if self._fault.piece is Piece.FRAME:
            return self._passed(chunk) if chunk.is_frame else [chunk]
        return joined(self._bytes_passed(chunk))

    def _bytes_passed(self, chunk: Chunk) -> Iterator[Chunk]:
        """Yield what becomes of the bytes of a chunk; nothing follows the end of the line."""
        for byte in bytes_of(chunk):
            for part in self._passed(byte):
                yield part
                if part.cut:
                    return

    def _passed(self, piece: Chunk) -> Iterable[Chunk]:
        """Return what becomes of one piece."""
        self._count += 1
        if not self._hits():
            return [piece]
        fault = self._fault
        shown = piece.data[:_SHOWN].hex(" ") + (" …" if len(piece.data) > _SHOWN else "")
        assert fault.piece is not None  # only what has no direction has no pieces
        self._report(fault, f"{fault.piece.value} {self._count}: {shown}")
        if fault.action is Action.FLOOD:
            self._flood()
        return _BECOMES[fault.action](piece, fault, self._chance)

    def _hits(self) -> bool:
        """Say whether the rule chooses the piece that was just counted."""
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
    return [piece]  # the flood comes behind it


def _disconnect(piece: Chunk, fault: Fault, chance: Random) -> list[Chunk]:
    """Cut the line behind a byte, but in the midst of a frame."""
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
"""What becomes of a piece that is hit."""


class FaultChain:
    """Takes chunks, sends them through the faults, and hands on what comes out, when it is due.

    A chunk that is late holds up what follows, as on a serial line, unless it may be overtaken.

    :param clock: the time.
    :param hand_on: takes what arrives; it may lead to :meth:`clear`.
    :param lost: told, in words, of bytes for which there is no room.
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
        self._count = 0  # chunks of one instant arrive in the order in which they were sent
        self._latest = 0  # when the last chunk arrives that holds up others
        self.clear()

    def clear(self) -> None:
        """Lose all that is late: the line was cut."""
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
        """Yield what came of ``size`` bytes, to the end of the line, or until it is too much."""
        room = size + MOST_HELD
        for chunk in chunks:
            room -= len(chunk.data)
            if room < 0:
                self._lost(f"lost the rest of what came of {size} bytes: over {MOST_HELD} more")
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
            self._lost(f"lost {len(chunk.data)} bytes: over {MOST_HELD} are held back")
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
        """See to it that there is a timer for what is due next, and no other."""
        due = self._late[0][0] if self._late else None
        if self._timer is not None:
            if self._timer.when == due:
                return
            self._timer.cancel()
        self._timer = None if due is None else self._clock.call_at(due, self._arrive)

    def _arrive(self) -> None:
        """Hand on what is due."""
        self._timer = None
        while self._late and self._late[0][0] <= self._clock.now:
            chunk = heapq.heappop(self._late)[2]
            self._held -= len(chunk.data)
            self._in_order -= not chunk.overtaken
            self._hand_on(chunk)
        self._set_timer()

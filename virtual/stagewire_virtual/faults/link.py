"""A faulty link: it is placed between a link and a controller, and looks like the latter.

A flood sends frames that nobody asked for, one after another.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Final

from stagewire.framing import Event, Garbage
from stagewire.protocols import Direction
from stagewire_virtual.clock import Clock, nanoseconds
from stagewire_virtual.errors import FaultError, VirtualError
from stagewire_virtual.faults.chain import Chunk, Effect, FaultChain
from stagewire_virtual.faults.fault import Action, Fault, Piece, one_of, parse_faults
from stagewire_virtual.framings import framing_of
from stagewire_virtual.framings.framing import Framing, RequestReader
from stagewire_virtual.instrument import Instrument, Unit, ignore

_COUNT: Final = 100
_PERIOD: Final = 0.01  # seconds: ten times as often as status updates come


class Flood:
    """Sends the same frame again and again; begun anew while it runs, it goes on as it is.

    :param clock: the time.
    :param send: takes a frame.
    :param data: the frame.
    :param count: how many; by default 100.
    :param period: seconds between two; by default 0.01.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[bytes], None],
        data: bytes,
        count: int | None,
        period: float | None,
    ) -> None:
        self._clock = clock
        self._send = send
        self._data = data
        self._count = count or _COUNT
        self._period = nanoseconds(_PERIOD if period is None else period)
        self._left = 0

    def begin(self) -> None:
        """Begin as soon as time goes on."""
        if not self._left:
            self._left = self._count
            self._clock.call_later(0, self._next)

    def _next(self) -> None:
        self._left -= 1
        if self._left:
            self._clock.call_later(self._period, self._next)
        self._send(self._data)


_REMEMBERED: Final = 1000


@dataclass(frozen=True, slots=True)
class FaultEvent:
    """What a fault did.

    :param time: when, in nanoseconds of the clock.
    :param fault: which one; None where the line itself had no room.
    :param what: to what: ``frame 10: 64 04 01 00 01 50``.
    """

    time: int
    fault: Fault | None
    what: str

    def __str__(self) -> str:
        return f"{self.fault or 'line'}: {self.what}"


class FaultyLink:
    """Takes what the host sends and gives what the controller says, with faults; without any it adds nothing.

    The faults of one direction come in the order in which they are given, each of them over what the others
    before it left. In each direction 64 KiB may be late at a time; what is beyond that is lost.

    Frames are what the controller says at once, and what the protocol cuts the bytes of the host into.
    Where a fault counts those, bytes of the host pass on as soon as their frame is whole; the text of a
    terminal, which is no frame, perhaps never.

    :param instrument: the controller.
    :param faults: what goes wrong, as text or as :class:`Fault`.
    :param seed: of what is left to chance; each fault has a stream of chance of its own.

    Raises :class:`~stagewire_virtual.errors.FaultError` for a fault that the unit cannot have.
    """

    def __init__(
        self, instrument: Instrument, faults: Iterable[Fault | str] = (), seed: int = 0
    ) -> None:
        self.instrument = instrument
        self.on_send: Callable[[bytes], None] = ignore
        """Called with what arrives at the host."""
        self.on_disconnect: Callable[[], None] = ignore
        """Called when the line is cut; who serves it closes the connection."""
        self.on_fault: Callable[[FaultEvent], None] = ignore
        """Called with what a fault did, when it did."""
        self.happened: deque[FaultEvent] = deque(maxlen=_REMEMBERED)
        """What faults did last."""
        self._clock = instrument.clock
        self._asked: str | None = None  # the command that the controller is about to answer
        self._is_cut = False  # until the host sends again: then it has connected anew
        self._framing = framing_of(instrument.unit.protocol)
        made = parse_faults(faults)
        for fault in made:
            _check(fault, instrument.unit, self._framing)
        self._named = any(fault.message for fault in made)
        self._reader: RequestReader | None = None
        if _need_frames(made, self._framing):
            self._reader = RequestReader(self._framing, self._clock, self._take)
        lost = partial(self._report, None)
        self._chains = {
            Direction.TO_HOST: FaultChain(self._clock, self._to_host, lost),
            Direction.TO_CONTROLLER: FaultChain(self._clock, self._to_controller, lost),
        }
        for number, fault in enumerate(made):
            self._install(fault, seed, number)
        instrument.on_send = self._said

    def host_came(self) -> None:
        """Hear that a host has come: what is on its way to the one before it is lost."""
        self._chains[Direction.TO_HOST].clear()
        self.instrument.host_came()

    def receive(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        if self._reader is None:
            self._chains[Direction.TO_CONTROLLER].take(Chunk(data))
            return
        self._is_cut = False
        self._reader.feed(data)

    def _take(self, event: Event) -> None:
        """Take a frame of the host, or what is none."""
        if self._is_cut:
            return  # it was still on its way
        is_frame = not isinstance(event, Garbage)
        name = self._framing.message_name(event.raw) if self._named and is_frame else None
        self._chains[Direction.TO_CONTROLLER].take(Chunk(event.raw, is_frame, name))

    def _said(self, data: bytes) -> None:
        """Take a frame of the controller."""
        name = None
        if self._named:
            named_by_request = self._framing.replies_are_named_by_requests
            name = self._asked if named_by_request else self._framing.message_name(data)
        self._chains[Direction.TO_HOST].take(Chunk(data, is_frame=True, message=name))

    def _to_host(self, chunk: Chunk) -> None:
        if chunk.data:
            self.on_send(chunk.data)
        if chunk.cut:
            self._cut()

    def _to_controller(self, chunk: Chunk) -> None:
        self._asked = chunk.message
        if chunk.data:
            self.instrument.receive(chunk.data)
        if chunk.cut:
            self._cut()

    def _cut(self) -> None:
        """Cut the line: what is on its way is lost."""
        self._is_cut = True
        for chain in self._chains.values():
            chain.clear()
        self.on_disconnect()

    # Faults

    def _install(self, fault: Fault, seed: int, number: int) -> None:
        """Put a fault in its place: in its chain, or on the clock."""
        if fault.direction is None:
            self._stick(fault)
            return
        chain = self._chains[fault.direction]
        begin = self._begin_flood(fault, chain) if fault.action is Action.FLOOD else self._cut
        if fault.is_timed:
            self._at(fault.after or 0, fault, "begins", begin)
            return
        origin = f"{seed}/{number}" if fault.seed is None else f"{fault.seed}"
        chance = Random(f"{origin}/faults/{fault.direction.name}")
        chain.effects = (*chain.effects, Effect(fault, chance, self._report, begin))

    def _begin_flood(self, fault: Fault, chain: FaultChain) -> Callable[[], None]:
        def send(data: bytes) -> None:
            chain.send(Chunk(data, is_frame=True))

        if fault.data is None and fault.direction is not Direction.TO_HOST:
            raise FaultError(f"{fault}: a flood to the controller needs hex=BYTES")
        data = (
            self._framing.status_frame(self.instrument.unit) if fault.data is None else fault.data
        )
        if data is None:
            name = self.instrument.unit.name
            raise FaultError(f"the {name} has no status message that is known; give hex=BYTES")
        return Flood(self._clock, send, data, fault.count, fault.period).begin

    def _stick(self, fault: Fault) -> None:
        bay = "" if fault.bay is None else f"bay {fault.bay}, "
        part = f"axis {fault.axis}" if fault.axis else f"{bay}channel {fault.channel}"
        stick = self.instrument.stick
        try:
            stick(part, False)
        except VirtualError as error:  # a part that is not there
            raise FaultError(f"{fault}: {error}") from None
        begin = fault.after or 0
        self._at(begin, fault, f"{part} is stuck", partial(stick, part, True))
        if fault.lasting is not None:
            self._at(begin + fault.lasting, fault, f"{part} is free", partial(stick, part, False))

    def _at(self, seconds: float, fault: Fault, what: str, act: Callable[[], None]) -> None:
        """Let a fault do something after so many seconds, and report it.

        By the clock for none, too: who serves the line wants to be told, and is not there yet.
        """

        def now() -> None:
            self._report(fault, what)
            act()

        self._clock.call_later(nanoseconds(seconds), now)

    def _report(self, fault: Fault | None, what: str) -> None:
        happened = FaultEvent(self._clock.now, fault, what)
        self.happened.append(happened)
        self.on_fault(happened)


def _check(fault: Fault, unit: Unit, framing: Framing) -> None:
    """Raise for a message that never passes there."""
    if fault.message is None:
        return
    if fault.message not in unit.messages:
        known = sorted(unit.messages)
        raise FaultError(
            f"{fault}: the {unit.name} has no message {one_of(fault.message, known)} "
            f"('stagewire show {unit.name}' names them)"
        )
    if why := framing.never_passes(unit, fault.message, fault.direction):
        raise FaultError(f"{fault}: {why}")


def _need_frames(faults: Iterable[Fault], framing: Framing) -> bool:
    """Say whether what the host sends has to be cut into frames."""
    return any(
        (fault.message and framing.replies_are_named_by_requests)
        or (
            fault.direction is Direction.TO_CONTROLLER
            and (fault.message or fault.piece is Piece.FRAME)
        )
        for fault in faults
    )

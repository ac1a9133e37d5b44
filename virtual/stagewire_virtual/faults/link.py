"""A wrapper around a controller that applies faults to its line, and the floods that it sends."""

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
_PERIOD: Final = 0.01  # seconds: ten times as often as status updates


class Flood:
    """Sends the same frame repeatedly; beginning again while it runs has no effect.

    :param clock: the clock.
    :param send: sends a frame.
    :param data: the frame.
    :param count: the number of frames; 100 by default.
    :param period: the time between two frames in seconds; 0.01 by default.
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
        """Begin when the clock runs next."""
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
    """A record of a fault that happened.

    :param time: the instant, in nanoseconds of the clock.
    :param fault: the fault; None if bytes were lost because the limit was reached.
    :param what: the affected piece, such as ``frame 10: 64 04 01 00 01 50``.
    """

    time: int
    fault: Fault | None
    what: str

    def __str__(self) -> str:
        return f"{self.fault or 'line'}: {self.what}"


class FaultyLink:
    """Passes bytes between a host and a controller and applies faults to them.

    The faults of one direction apply in the given order, each to the result of the previous one. Each
    direction holds back at most 64 KiB; further bytes are lost.

    Towards the host, a frame is what the controller sends at one instant. Towards the controller, it is what
    the framer of the protocol finds in the bytes of the host. If a fault counts these frames, bytes of the
    host are passed on when their frame is complete, which may never happen to text from a terminal.

    :param instrument: the controller.
    :param faults: the faults, as text or as :class:`Fault`.
    :param seed: the seed of random choices; each fault derives its own random stream from it.

    Raises :class:`~stagewire_virtual.errors.FaultError` for a fault that the unit cannot have.
    """

    def __init__(
        self, instrument: Instrument, faults: Iterable[Fault | str] = (), seed: int = 0
    ) -> None:
        self.instrument = instrument
        self.on_send: Callable[[bytes], None] = ignore
        """Called with bytes that arrive at the host."""
        self.on_disconnect: Callable[[], None] = ignore
        """Called when the line is cut, so that the server closes the connection."""
        self.on_fault: Callable[[FaultEvent], None] = ignore
        """Called when a fault happens."""
        self.happened: deque[FaultEvent] = deque(maxlen=_REMEMBERED)
        """The last faults that happened."""
        self._clock = instrument.clock
        self._asked: str | None = None  # the command that the controller is about to answer
        self._is_cut = False  # until the host sends again, after it has reconnected
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
        """Note that a host has connected; bytes on their way to the previous one are lost."""
        self._chains[Direction.TO_HOST].clear()
        self.instrument.host_came()

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        if self._reader is None:
            self._chains[Direction.TO_CONTROLLER].take(Chunk(data))
            return
        self._is_cut = False
        self._reader.feed(data)

    def _take(self, event: Event) -> None:
        """Take a frame of the host, or bytes outside a frame."""
        if self._is_cut:
            return  # the frame was still on its way when the line was cut
        is_frame = not isinstance(event, Garbage)
        name = self._framing.message_name(event.raw) if self._named and is_frame else None
        self._chains[Direction.TO_CONTROLLER].take(Chunk(event.raw, is_frame, name))

    def _said(self, data: bytes) -> None:
        """Take a frame from the controller."""
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
        """Cut the line; bytes on their way are lost."""
        self._is_cut = True
        for chain in self._chains.values():
            chain.clear()
        self.on_disconnect()

    # Faults

    def _install(self, fault: Fault, seed: int, number: int) -> None:
        """Add a fault to its chain, or set its timer."""
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
            raise FaultError(f"{fault}: a flood to the controller requires hex=BYTES")
        data = (
            self._framing.status_frame(self.instrument.unit) if fault.data is None else fault.data
        )
        if data is None:
            name = self.instrument.unit.name
            raise FaultError(f"the {name} has no known status message; give hex=BYTES")
        return Flood(self._clock, send, data, fault.count, fault.period).begin

    def _stick(self, fault: Fault) -> None:
        bay = "" if fault.bay is None else f"bay {fault.bay}, "
        part = f"axis {fault.axis}" if fault.axis else f"{bay}channel {fault.channel}"
        stick = self.instrument.stick
        try:
            stick(part, False)
        except VirtualError as error:  # the part does not exist
            raise FaultError(f"{fault}: {error}") from None
        begin = fault.after or 0
        self._at(begin, fault, f"{part} is stuck", partial(stick, part, True))
        if fault.lasting is not None:
            self._at(begin + fault.lasting, fault, f"{part} is free", partial(stick, part, False))

    def _at(self, seconds: float, fault: Fault, what: str, act: Callable[[], None]) -> None:
        """Run ``act`` after a number of seconds, and report it.

        A timer is used even for 0 seconds, because the callback for reports is not set yet.
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
    """Raise if the message of a fault is never sent in its direction."""
    if fault.message is None:
        return
    if fault.message not in unit.messages:
        known = sorted(unit.messages)
        raise FaultError(
            f"{fault}: the {unit.name} has no message {one_of(fault.message, known)} "
            f"('stagewire show {unit.name}' lists them)"
        )
    if why := framing.never_passes(unit, fault.message, fault.direction):
        raise FaultError(f"{fault}: {why}")


def _need_frames(faults: Iterable[Fault], framing: Framing) -> bool:
    """Return whether the bytes of the host must be cut into frames."""
    return any(
        (fault.message and framing.replies_are_named_by_requests)
        or (
            fault.direction is Direction.TO_CONTROLLER
            and (fault.message or fault.piece is Piece.FRAME)
        )
        for fault in faults
    )

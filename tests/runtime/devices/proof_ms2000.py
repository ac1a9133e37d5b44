"""A controller of axes with random values, whose replies have no frame."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from contextlib import AbstractAsyncContextManager
from typing import Any

from proof_calls import Call, calls, fields_at_random, units
from proof_line import FarEnd, settled

from stagewire.framing import CommandReceived, TextReceived, host_framer
from stagewire.protocols import Command, CommandFrame, Reply
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import enumerations as e
from stagewire_ms2000 import messages as c

NAME, PACKAGE = "asi_ms2000", "stagewire_ms2000"
UNITS = units(NAME)
LOW, HIGH = c.SwitchToLowLevel().pack(), c.SwitchToHighLevel().pack()
MOVES = (c.WriteTargetPosition, c.IncrementMoveUp, c.IncrementMoveDown, c.WriteVectorSpeed)
DRAIN, USUAL = 0.2, 1.0
"""Seconds of silence after which a line is drained, and the usual timeout of a reply."""
Said = Iterable[tuple[float, bytes | None]]


def axis_calls(unit: str) -> list[Call]:
    """Return the calls of an axis."""
    return [call for call in calls(unit, PACKAGE) if call.part == "axis"]


def queries(unit: str) -> list[Call]:
    return [call for call in axis_calls(unit) if call.kind == "_ask"]


class Axes(FarEnd):
    """A controller that answers each read after a millisecond, with values that stay until :meth:`renew`.

    A move reaches its target, which then is the position of the axis.

    :ivar lasts: duration of a move in seconds, unless it is stopped.
    :ivar raw: received bytes.
    :ivar heard: received commands.
    :ivar say_so: replaces only the next reply by given bytes, each with a delay in seconds.
    """

    def __init__(self, seed: int = 1) -> None:
        self.lasts = 0.35
        self.raw = b""
        self.heard: list[CommandFrame] = []
        self.say_so: Callable[[bytes], Said] | None = None
        self.begin()
        self._draw = random.Random(seed)
        self._state: dict[tuple[int, type], Any] = {}
        self._positions: dict[int, int] = {}
        self._lines = 0
        self._busy_until: dict[int, float] = {}

    def begin(self) -> None:
        """Start a new framer for the following bytes."""
        self._framer = host_framer(PROTOCOL)

    def renew(self) -> None:
        """Replace all values by new random ones."""
        self._state.clear()
        self._lines += 1

    def fix(self, cls: type[Reply], axis: int = 0x18, **values: int) -> None:
        """Set the values of a reply."""
        self._state[axis, cls] = cls(**values)

    def forget(self) -> None:
        """Forget the received bytes and commands."""
        self.raw = b""
        self.heard.clear()

    def names(self) -> list[str]:
        """Return the names of the received commands."""
        return [frame.message.layout.message for frame in self.heard]

    def moves(self) -> int:
        """Return how many received commands start a motion."""
        return sum(isinstance(frame.message, MOVES) for frame in self.heard)

    def take(self, data: bytes) -> Said:
        self.raw += data
        said: list[tuple[float, bytes | None]] = []
        for event in self._framer.feed(data):
            reply = self._hear(event)
            if reply:
                said += self._said(reply)
        return said

    def _said(self, reply: bytes) -> Said:
        if self.say_so is None:
            return [(0.001, reply)]
        say_so, self.say_so = self.say_so, None
        return say_so(reply)

    def _hear(self, event: Any) -> bytes:
        """Handle an event, and return the reply."""
        if isinstance(event, TextReceived):
            return f"{self.line}\r\n".encode("ascii")
        assert isinstance(event, CommandReceived), f"the host sent an invalid command: {event!r}"
        frame = event.frame
        self.heard.append(frame)
        self._follow(frame)
        if isinstance(frame.message, MOVES):
            self._busy_until[frame.axis or 0] = self.now() + self.lasts
        elif isinstance(frame.message, c.StopMotor):
            self._busy_until[frame.axis or 0] = self.now()
        return b"" if frame.message.reply is None else self.state(frame).pack()

    def _follow(self, frame: CommandFrame) -> None:
        """Update the position of an axis after a move."""
        message: Any = frame.message
        axis, cls = frame.axis or 0, c.ReadMotorPositionAndStatusReply
        ways = {c.IncrementMoveUp: 1, c.IncrementMoveDown: -1}
        if isinstance(message, c.WriteTargetPosition):
            self._positions[axis] = message.target_position
        elif type(message) in ways:
            step = self.truth(c.ReadIncrementValue, axis).increment
            here = self.truth(c.ReadMotorPositionAndStatus, axis).position
            self._positions[axis] = here + ways[type(message)] * step
        if axis in self._positions:
            self.fix(cls, axis, position=self._positions[axis], status=0)

    @property
    def line(self) -> str:
        """The current reply to a line of text."""
        return f":A {self._lines}"

    def state(self, frame: CommandFrame) -> Any:
        """Return the current reply to a read."""
        axis, cls = frame.axis or 0, frame.message.reply
        assert cls is not None
        if cls is c.ReadStatusReply:
            busy = self._busy_until.get(axis, 0.0) > self.now()
            return cls(status=e.Busy.BUSY if busy else e.Busy.NOT_BUSY)
        if (axis, cls) not in self._state:
            fields = fields_at_random(cls, self._draw, NAME)
            for name in fields.keys() & {"position", "increment"}:
                fields[name] //= 4  # so that their sum is also a valid position
            self._state[axis, cls] = cls(**fields)
        return self._state[axis, cls]

    def truth(self, request: type[Command], axis: int = 0x18) -> Any:
        """Return the current reply to ``request``."""
        return self.state(CommandFrame(request(), axis))


def opened(bench: Any, unit: str = "MS2000", **options: Any) -> AbstractAsyncContextManager[Any]:
    """Open a device that sends nothing when it is closed: ``async with opened(bench) as device:``."""
    found: AbstractAsyncContextManager[Any] = bench.open(
        unit, PACKAGE, **{"on_close": "leave", **options}
    )
    return found


async def works(device: Any, far: Axes) -> None:
    """Check that a device in low-level mode works and returns current values."""
    axis = device.axis("X")
    await settled(axis.stop())
    far.forget()
    for name, request in [
        ("read_motor_position", c.ReadMotorPosition),
        ("read_target_position", c.ReadTargetPosition),  # its reply is as long as the previous one
        ("read_status_byte", c.ReadStatusByte),
        ("read_identification", c.ReadIdentification),
    ]:
        far.renew()
        values = await settled(getattr(axis, name)(timeout=3))
        assert values.message == far.truth(request), name
    assert not await settled(axis.is_moving())
    await settled(axis.move_absolute(counts=5))
    assert far.moves() == 1

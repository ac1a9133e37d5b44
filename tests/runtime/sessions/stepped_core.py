"""A session core with stepped time and without a link; tests of the cores use it."""

from __future__ import annotations

from math import inf
from typing import Any

from stagewire._sessions.core import Core
from stagewire._sessions.exchange import Exchange
from stagewire.protocols import FramedMessage
from stagewire.sessions import CommandCore, Ends, FramedCore, SessionOptions
from stagewire_apt import messages as m
from stagewire_ms2000 import PROTOCOL as MS2000
from undocumented import PROTOCOL

HOST = 0x01
VEL = (m.MotGetVelParams,)
MOVED = Ends(completed=(m.MotMoveCompletedHeader,), stopped=(m.MotMoveStoppedHeader,))
STOPPED = Ends(completed=(m.MotMoveStoppedHeader,))


def vel_params(max_velocity: int = 7, chan_ident: int = 1) -> m.MotGetVelParams:
    """Return a reply to MOT_REQ_VELPARAMS, identified by its maximum velocity."""
    return m.MotGetVelParams(
        chan_ident=chan_ident, min_velocity=0, acceleration=1, max_velocity=max_velocity
    )


def dc_status(position: int = 0, chan_ident: int = 1) -> m.MotGetDcStatusUpdate:
    """Return the status that a controller sends ten times a second."""
    return m.MotGetDcStatusUpdate(
        chan_ident=chan_ident, position=position, velocity=0, status_bits=0
    )


def said(message: FramedMessage, source: int = 0x50, dest: int = HOST) -> bytes:
    """Return the bytes of a message from a controller."""
    return message.pack(dest, source)


class Stepped:
    """Drives a core like a driver: output after each call, and tick when something is due.

    After each step it asserts that nothing is due any more, because a driver would spin.
    """

    def __init__(self, core: Core) -> None:
        self.any: Any = core
        self.now = 100.0
        self.wrote = b""

    def flush(self) -> bytes:
        """Write the bytes that may be written now, and return them."""
        data = self.any.output(self.now)
        self.wrote += data
        due = self.due
        assert due is None or due > self.now, "a driver would spin"
        return data

    @property
    def due(self) -> float | None:
        """When the core must be called next, with bytes or without."""
        due = min(inf if self.any.due is None else self.any.due, self.any.silent_at)
        return None if due == inf else due

    def hear(self, *data: bytes) -> bytes:
        """Pass received bytes to the core, and return the bytes written then."""
        for chunk in data:
            self.any.receive(chunk, self.now)
        return self.flush()

    def until(self, when: float) -> bytes:
        """Advance the time, stopping whenever something is due; return the bytes written."""
        written = b""
        while (due := self.due) is not None and due <= when:
            written += self._look_around(due)
        return written + self._look_around(when)

    def _look_around(self, when: float) -> bytes:
        self.now = max(self.now, when)
        self.any.receive(b"", self.now)
        self.any.tick(self.now)
        return self.flush()

    def later(self, seconds: float) -> bytes:
        """Advance the time by some seconds."""
        return self.until(self.now + seconds)

    def cancel(self, exchange: Exchange) -> bytes:
        """Cancel an exchange; return the bytes written then."""
        self.any.cancel(exchange, self.now)
        return self.flush()


class Framed(Stepped):
    """A core for controllers whose messages have frames."""

    def __init__(self, **options: float) -> None:
        super().__init__(FramedCore(PROTOCOL, options=SessionOptions(**options)))
        self.core: FramedCore = self.any

    def ask(
        self,
        message: FramedMessage | None = None,
        replies: tuple[type[FramedMessage], ...] = VEL,
        dest: int = 0x50,
        timeout: float = 1.0,
    ) -> Exchange:
        """Send a request, by default for the velocity parameters of channel 1."""
        message = message or m.MotReqVelParams(1)
        exchange = self.core.ask(message, replies, dest, timeout, self.now)
        self.flush()
        return exchange

    def send(self, message: FramedMessage | None = None, dest: int = 0x50) -> Exchange:
        """Send a message without a reply."""
        exchange = self.core.send(message or m.ModIdentify(), dest, 1.0, self.now)
        self.flush()
        return exchange

    def move(
        self, dest: int = 0x50, timeout: float = 60.0, chan_ident: int = 1, ends: Ends = MOVED
    ) -> Exchange:
        """Begin a move."""
        message = m.MotMoveAbsolute(chan_ident, 1000)
        exchange = self.core.begin(message, ends, dest, timeout, self.now)
        self.flush()
        return exchange

    def halt(self, dest: int = 0x50, ends: Ends | None = STOPPED, timeout: float = 1.0) -> Exchange:
        """Stop a move."""
        exchange = self.core.halt(m.MotMoveStop(1, 2), ends, dest, timeout, self.now)
        self.flush()
        return exchange


class Commands(Stepped):
    """A core for a controller whose replies have no frame; in low-level mode by default."""

    def __init__(self, low_level: bool = True, **options: Any) -> None:
        refuse = options.pop("refuse_prefix_bytes", False)
        super().__init__(
            CommandCore(MS2000, options=SessionOptions(**options), refuse_prefix_bytes=refuse)
        )
        self.core: CommandCore = self.any
        if low_level:
            self.send(MS2000.build("SWITCH_TO_LOW_LEVEL", {}), None)
            self.later(1)
            self.wrote = b""

    def ask(self, message: Any, axis: int = 24, timeout: float = 1.0) -> Exchange:
        """Send a request to an axis."""
        exchange = self.core.ask(message, axis, timeout, self.now)
        self.flush()
        return exchange

    def send(self, message: Any, axis: int | None = 24) -> Exchange:
        """Send a command without a reply."""
        exchange = self.core.send(message, axis, 1.0, self.now)
        self.flush()
        return exchange

    def text(self, line: str, timeout: float = 1.0) -> Exchange:
        """Send a line of text."""
        exchange = self.core.text(line, timeout, self.now)
        self.flush()
        return exchange

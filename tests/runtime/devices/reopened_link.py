"""A virtual TDC001 that keeps running while its line is cut, closed and reopened, for threads and asyncio.

Its lines have the URL ``kept://``, so that ``reconnect()`` reaches the same controller. It checks that no
move arrives while an earlier one may still be under way.
"""

from __future__ import annotations

import asyncio
import sys
import types
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from typing import Any, TypeVar

import stagewire_virtual as virtual
from stagewire import End
from stagewire.errors import LinkOpenError, TransportLostError
from stagewire.links import AsyncLink
from stagewire_apt import PROTOCOL, stages
from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.linking import SteppedLink
from stagewire_virtual.stepped import SteppedEventLoop

T = TypeVar("T")

URL = "kept://"
MOVING = 0x02F0  # moving, jogging and homing, page 79
MOVES = (m.MotMoveAbsolute, m.MotMoveHome, m.MotMoveJog, m.MotMoveVelocity)
ENDS = (m.MotMoveCompletedDc, m.MotMoveStoppedDc, m.MotMoveHomed)


class KeptController:
    """The controller, with a record of the traffic on its lines."""

    def __init__(self, serial_number: int = 83_000_001) -> None:
        self.controller = virtual.TDC001(
            stage=stages.Z8, travel=20 * 34304, serial_number=serial_number
        )
        self.reachable = True  # a line to it can be opened
        self.deaf = False  # bytes of the host are lost
        self.mute = False  # bytes to the host are lost
        self.first_byte_at: float | None = None  # of the host, on the current line
        self.cut_at_write = False  # the next write fails, and the line is lost
        self.may_move = False  # whether a motion may be under way, as far as a host can know
        self.moves = 0
        self.on_unplug: Callable[[], object] = lambda: None
        self._heard = PROTOCOL.framer(End.DEVICE)
        self._said = PROTOCOL.framer(End.HOST)
        self._said.tell(0x50, status="dc")

    def plug_in(self) -> None:
        """Start a new line."""
        if not self.reachable:
            raise LinkOpenError(f"{URL}: connection refused")
        self.controller.plug_in()
        self.first_byte_at = None
        self._heard.reset()
        self._said.reset()

    def unplug(self) -> None:
        """Cut the line."""
        self.controller.unplug()
        self.on_unplug()

    def take(self, data: bytes) -> None:
        """Receive bytes of the host."""
        if self.cut_at_write:
            self.cut_at_write = False
            self.unplug()
        try:
            self.controller.link.write(b"" if self.deaf else data)
        except UnpluggedError as error:
            raise TransportLostError(f"{URL}: {error}") from None
        if self.first_byte_at is None:
            self.first_byte_at = self.controller.clock.now / SECOND
        if self.deaf:
            return
        for event in self._heard.feed(data):
            message = event.frame.message
            if isinstance(message, MOVES):
                assert not self.may_move, "a second move was sent while the first may be under way"
                self.may_move = True
                self.moves += 1
            elif isinstance(message, m.MotMoveStop):
                self.may_move = False

    def say(self, data: bytes) -> bytes:
        """Check bytes on their way to the host."""
        if self.mute:
            return b""
        for event in self._said.feed(data):
            message = event.frame.message
            rests = isinstance(message, m.MotGetDcStatusUpdate) and not message.status_bits & MOVING
            if rests or isinstance(message, ENDS):
                self.may_move = False
        return data


class _KeptLink(SteppedLink):
    def __init__(self, kept: KeptController) -> None:
        kept.plug_in()
        super().__init__(kept.controller)
        self.url = URL
        self._kept = kept

    def read(self, timeout: float) -> bytes:
        return self._kept.say(super().read(timeout))

    def write(self, data: bytes) -> None:
        self._check_open()
        self._kept.take(data)


class _KeptAsyncLink(AsyncLink):
    """The same link for an event loop, whose clock is also that of the controller."""

    def __init__(self, kept: KeptController) -> None:
        kept.plug_in()
        self.url = URL
        self._kept = kept
        self._loop = asyncio.get_running_loop()
        self._open = True
        self._timer: asyncio.TimerHandle | None = None
        kept.on_unplug = lambda: self._loop.call_soon(self._look)
        self._received: Callable[[bytes], None]
        self._lost: Callable[[TransportLostError], None]

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        self._received, self._lost = received, lost
        self._look()

    def write(self, data: bytes) -> None:
        if not self._open:
            raise TransportLostError(f"{URL}: gone")
        self._pass_time()
        self._kept.take(data)
        self._loop.call_soon(self._look)

    def write_now(self, data: bytes) -> None:
        with suppress(TransportLostError):
            self.write(data)

    async def close(self) -> None:
        self._open = False

    def _pass_time(self) -> None:
        clock = self._kept.controller.clock
        clock.run_until(max(clock.now, round(self._loop.time() * SECOND)))

    def _look(self) -> None:
        if not self._open:
            return
        self._pass_time()
        controller = self._kept.controller
        try:
            data = controller.link.read()
        except UnpluggedError:
            self._open = False
            self._lost(TransportLostError(f"{URL}: the line was unplugged"))
            return
        if data := self._kept.say(data):
            self._received(data)
        due = controller.clock.next_due
        if self._timer is not None:
            self._timer.cancel()
        if due is not None:
            self._timer = self._loop.call_at(due / SECOND + 1e-9, self._look)


class Side:
    """One way to use a device: plain calls, or calls run to completion by an event loop in simulated time."""

    def __init__(self, asynchronous: bool) -> None:
        self.package = "stagewire_apt.aio" if asynchronous else "stagewire_apt"
        self._loop = SteppedEventLoop() if asynchronous else None

    def run(self, call: Callable[[], Awaitable[T] | T]) -> Any:
        """Make a call and return what it returns."""
        if self._loop is None:
            return call()

        async def made() -> Any:
            result: Any = call()
            return await result if hasattr(result, "__await__") else result

        return self._loop.run_until_complete(made())

    def pass_time(self, kept: KeptController, seconds: float) -> None:
        """Let time pass, with or without an open line."""
        if self._loop is None:
            kept.controller.advance(seconds)
        else:
            self.run(lambda: asyncio.sleep(seconds))

    def close(self) -> None:
        if self._loop is not None:
            self._loop.close()


@contextmanager
def lines_to(current: Callable[[], KeptController]) -> Iterator[None]:
    """Make ``kept://`` open a line to the controller that ``current`` returns."""
    module = types.ModuleType("kept_lines")

    def open_link(url: str, settings: object) -> _KeptLink:
        return _KeptLink(current())

    async def open_async_link(url: str, settings: object) -> _KeptAsyncLink:
        return _KeptAsyncLink(current())

    module.open_link = open_link  # type: ignore[attr-defined]
    module.open_async_link = open_async_link  # type: ignore[attr-defined]
    entry = metadata.EntryPoint("kept", module.__name__, "stagewire.links")
    installed = metadata.entry_points

    def entry_points(**wanted: Any) -> Any:
        if wanted == {"group": "stagewire.links", "name": "kept"}:
            return metadata.EntryPoints([entry])
        return installed(**wanted)

    sys.modules[module.__name__] = module
    metadata.entry_points = entry_points
    try:
        yield
    finally:
        metadata.entry_points = installed
        del sys.modules[module.__name__]

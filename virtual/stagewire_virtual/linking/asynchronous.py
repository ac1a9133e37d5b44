"""A line in memory to a controller that lives in the time of an event loop."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Self

from stagewire.errors import TransportLost
from stagewire.links import AsyncLink
from stagewire_virtual.clock import SECOND, RealClock
from stagewire_virtual.serving.link import FarEnd, Maker, Run, ServedLink
from stagewire_virtual.serving.server import Server

__all__ = ["AsyncVirtualLink"]


class AsyncVirtualLink(AsyncLink):
    """A line whose host is in the same event loop; made by :meth:`open`.

    No thread, and no tick: the loop wakes when something is due. The controller's time is that of the loop;
    so it jumps where the loop's does.
    """

    def __init__(self, url: str, make: Maker, loop: asyncio.AbstractEventLoop) -> None:
        self.url = url
        clock = RealClock(lambda: round(loop.time() * SECOND))
        self._line = _LoopLine(make(clock), loop)
        self._server = Server(clock)

    @classmethod
    async def open(cls, url: str, make: Maker) -> Self:
        """Make a controller, and a line to it."""
        link = cls(url, make, asyncio.get_running_loop())
        await link._server.open(link._line)
        return link

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLost], None]
    ) -> None:
        """Call back from now on; see :meth:`.AsyncLink.start`."""
        unplugged = f"{self.url}: the line to the controller was unplugged"
        self._line.start(received, lambda: lost(TransportLost(unplugged)))

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which takes them at once and answers when this has returned."""
        if not self._line.connected:
            raise TransportLost(f"{self.url}: the line to the controller is closed or unplugged")
        self._line.take(data)

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.AsyncLink.write_now`."""
        with contextlib.suppress(TransportLost):
            self.write(data)

    async def close(self) -> None:
        """Unplug the controller, which is no more."""
        self._line.leave()
        if self._line in self._server.links:
            await self._server.close()


class _LoopLine(ServedLink):
    """The far end of the line: keeps what the controller says until the loop comes round to it."""

    def __init__(self, far_end: FarEnd, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(far_end)
        self._loop = loop
        self._waiting = bytearray()
        self._called = False  # the loop will come round to it
        self._connected = True
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[], None] | None = None

    # As its server sees it

    @property
    def connected(self) -> bool:
        """Whether the line is plugged in."""
        return self._connected

    def disconnect(self) -> None:
        """Pull the plug: what was said before still comes, then the host hears of it."""
        self._connected = False
        self._call_soon()

    async def open(self, run: Run) -> None:
        """Be served."""
        self._run = run
        self._greet()

    async def close(self) -> None:
        """Be served no more."""
        self._connected = False

    def _backlog(self) -> int:
        return len(self._waiting)

    def _put(self, data: bytes) -> None:
        self._waiting += data
        self._call_soon()

    # As the host sees it

    def start(self, received: Callable[[bytes], None], lost: Callable[[], None]) -> None:
        """Begin to call back, with what was said until now first."""
        self._received, self._lost = received, lost
        self._call_soon()

    def take(self, data: bytes) -> None:
        """Take bytes of the host."""
        self._take(data)

    def leave(self) -> None:
        """Call back no more."""
        self._connected = False
        self._received = self._lost = None

    def _call_soon(self) -> None:
        # Not at once: the host may be in the midst of writing, and the controller in that of something.
        if not self._called and self._received is not None:
            self._called = True
            self._loop.call_soon(self._deliver)

    def _deliver(self) -> None:
        self._called = False
        if self._waiting and self._received is not None:
            data = bytes(self._waiting)
            self._waiting.clear()
            self._received(data)
        if not self._connected and self._lost is not None:
            lost, self._lost = self._lost, None
            lost()

"""Links in memory from a session to a virtual controller.

========================  ==============================================================================
:class:`VirtualLink`      a controller in real time, for threads
:class:`SteppedLink`      a controller whose clock runs while the host waits; for tests without a thread
:class:`AsyncVirtualLink` a controller that uses the time of an event loop
========================  ==============================================================================
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable
from typing import Self

from stagewire.errors import TransportLostError
from stagewire.links import AsyncLink, Link
from stagewire_virtual.clock import SECOND, RealClock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.serving.link import FarEnd, Maker, MemoryLink, Run, ServedLink
from stagewire_virtual.serving.server import Server


class VirtualLink(Link):
    """A link in real time that one thread reads, and any thread may write.

    The controller has no thread. A read that waits sleeps until the next timer of the controller's clock and
    runs it. Timers that fall due between two reads run in the second read, at their own instants.

    :param url: a name for people.
    :param make: makes the controller.
    """

    def __init__(self, url: str, make: Maker) -> None:
        self.url = url
        self._clock = RealClock()
        self._line = MemoryLink(make(self._clock), label=url)
        self._changed = threading.Condition()  # notified after a write, and to wake the reader
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return bytes from the controller; see :meth:`.Link.read`."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                self._check_open()
                self._clock.run_until(self._clock.now)
                if data := self._said():
                    return data
                left = end - time.monotonic()
                if self._woken or left <= 0:
                    self._woken = False
                    return b""
                due = self._clock.next_due
                if due is not None:
                    left = min(left, max(0, due - self._clock.now) / SECOND)
                self._changed.wait(min(left, threading.TIMEOUT_MAX))

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which processes them immediately."""
        with self._changed:
            self._check_open()
            try:
                self._line.write(data)
            except UnpluggedError as error:
                raise TransportLostError(f"{self.url}: {error}") from None
            self._changed.notify()

    def write_now(self, data: bytes) -> None:
        """Send bytes if the line is open; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    def wake(self) -> None:
        """Make the present or the next read return immediately without data."""
        with self._changed:
            self._woken = True
            self._changed.notify()

    def close(self) -> None:
        """Unplug the controller, which ends with its link."""
        with self._changed:
            self._closed = True
            self._line.disconnect()
            self._changed.notify()

    def _said(self) -> bytes:
        try:
            return self._line.read()
        except UnpluggedError:
            raise TransportLostError(
                f"{self.url}: the line to the controller was unplugged"
            ) from None

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLostError(f"{self.url}: the line was closed")


_LEAST = 1 / SECOND  # the clock rounds a shorter time to 0, which would never pass


class SteppedLink(Link):
    """A link to a :class:`.VirtualController`, for a session that waits in one thread.

    A read that waits advances the controller's clock until data arrives, so a move of a minute takes no real
    time. The session uses :attr:`clock` as its time and starts no reader thread.

    :param controller: a controller made by the test, which can inspect and close it.
    """

    def __init__(self, controller: VirtualController) -> None:
        self.url = f"virtual://{controller.label}"
        self.clock = lambda: controller.clock.now / SECOND
        self._line = controller.link
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return bytes from the controller; advance its clock by at most ``timeout`` seconds."""
        self._check_open()
        if self._woken:
            self._woken, timeout = False, 0
        try:
            return self._line.read(timeout=max(timeout, _LEAST) if timeout > 0 else 0)
        except UnpluggedError:
            raise TransportLostError(
                f"{self.url}: the line to the controller was unplugged"
            ) from None

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which processes them at this instant."""
        self._check_open()
        try:
            self._line.write(data)
        except UnpluggedError as error:
            raise TransportLostError(f"{self.url}: {error}") from None

    def write_now(self, data: bytes) -> None:
        """Send bytes if the line is open; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    def wake(self) -> None:
        """Make the next read return without advancing the clock."""
        self._woken = True

    def close(self) -> None:
        """Close the link; the controller stays as it is."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLostError(f"{self.url}: the line was closed")


class AsyncVirtualLink(AsyncLink):
    """A link whose host is in the same event loop; made by :meth:`open`.

    It uses no thread and does not poll: the loop wakes up for the next timer of the controller. Both use the
    time of the loop, so they jump together.
    """

    def __init__(self, url: str, make: Maker, loop: asyncio.AbstractEventLoop) -> None:
        self.url = url
        clock = RealClock(lambda: round(loop.time() * SECOND))
        self._line = _LoopLink(make(clock), loop)
        self._server = Server(clock)

    @classmethod
    async def open(cls, url: str, make: Maker) -> Self:
        """Make a controller and return a link to it."""
        link = cls(url, make, asyncio.get_running_loop())
        await link._server.open(link._line)
        return link

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Start calling back; see :meth:`.AsyncLink.start`."""
        unplugged = f"{self.url}: the line to the controller was unplugged"
        self._line.start(received, lambda: lost(TransportLostError(unplugged)))

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which processes them immediately; answers follow after the return."""
        if not self._line.connected:
            raise TransportLostError(
                f"{self.url}: the line to the controller is closed or unplugged"
            )
        self._line.take(data)

    def write_now(self, data: bytes) -> None:
        """Send bytes if the line is open; see :meth:`.AsyncLink.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    async def close(self) -> None:
        """Unplug the controller, which ends with its link."""
        self._line.leave()
        if self._line in self._server.links:
            await self._server.close()


class _LoopLink(ServedLink):
    """The controller's end of the line: buffers its bytes until the loop delivers them."""

    def __init__(self, far_end: FarEnd, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(far_end)
        self._loop = loop
        self._waiting = bytearray()
        self._called = False  # whether a delivery is scheduled
        self._connected = True
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[], None] | None = None

    # For the server

    @property
    def connected(self) -> bool:
        """Whether the line is plugged in."""
        return self._connected

    def disconnect(self) -> None:
        """Unplug the line: bytes sent before still arrive, then the host is notified."""
        self._connected = False
        self._call_soon()

    async def open(self, run: Run) -> None:
        """Start serving."""
        self._run = run
        self._greet()

    async def close(self) -> None:
        """Stop serving."""
        self._connected = False

    def _backlog(self) -> int:
        return len(self._waiting)

    def _put(self, data: bytes) -> None:
        self._waiting += data
        self._call_soon()

    # For the host

    def start(self, received: Callable[[bytes], None], lost: Callable[[], None]) -> None:
        """Start calling back, first with the bytes buffered so far."""
        self._received, self._lost = received, lost
        self._call_soon()

    def take(self, data: bytes) -> None:
        """Pass bytes from the host to the controller."""
        self._take(data)

    def leave(self) -> None:
        """Stop calling back."""
        self._connected = False
        self._received = self._lost = None

    def _call_soon(self) -> None:
        # Not immediately: the host may still be in write(), and the controller in a callback.
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

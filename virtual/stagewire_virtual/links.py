"""Links in memory to a controller, as sessions use them.

========================  ==============================================================================
:class:`VirtualLink`      to a controller that lives in real time, for threads
:class:`SteppedLink`      whose time goes on when its host waits; for tests without a thread
:class:`AsyncVirtualLink` to a controller that lives in the time of an event loop
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
    """A line whose host is a thread that reads, and others that write.

    The controller has no thread: a read that waits sleeps until something is due on its clock, and lets time
    go on. What a controller does while nobody reads, it has done when somebody does.

    :param url: for people.
    :param make: makes the controller.
    """

    def __init__(self, url: str, make: Maker) -> None:
        self.url = url
        self._clock = RealClock()
        self._line = MemoryLink(make(self._clock), label=url)
        self._changed = threading.Condition()  # something was written, or the reader is to wake
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return what the controller said; see :meth:`.Link.read`."""
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
        """Send bytes to the controller, which takes them at once."""
        with self._changed:
            self._check_open()
            try:
                self._line.write(data)
            except UnpluggedError as error:
                raise TransportLostError(f"{self.url}: {error}") from None
            self._changed.notify()

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    def wake(self) -> None:
        """Let the read that waits, or the next one, return without anything."""
        with self._changed:
            self._woken = True
            self._changed.notify()

    def close(self) -> None:
        """Unplug the controller, which is no more."""
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


_LEAST = 1 / SECOND  # what is shorter than the clock can tell would never pass


class SteppedLink(Link):
    """A line to a :class:`.VirtualController`, for a session that waits in one thread.

    A read that waits lets just as much time pass as it takes until something comes; a move of a minute takes
    none. A session takes its time from :attr:`clock`, and starts no thread that would read.

    :param controller: made by the test, which may look at it, and close it, as it likes.
    """

    def __init__(self, controller: VirtualController) -> None:
        self.url = f"virtual://{controller.label}"
        self.clock = lambda: controller.clock.now / SECOND
        self._line = controller.link
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return what the controller said, and let ``timeout`` seconds pass at most."""
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
        """Send bytes to the controller, which takes them at this instant."""
        self._check_open()
        try:
            self._line.write(data)
        except UnpluggedError as error:
            raise TransportLostError(f"{self.url}: {error}") from None

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    def wake(self) -> None:
        """Let the next read return without letting time pass."""
        self._woken = True

    def close(self) -> None:
        """Use the line no more; the controller stays as it is."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLostError(f"{self.url}: the line was closed")


class AsyncVirtualLink(AsyncLink):
    """A line whose host is in the same event loop; made by :meth:`open`.

    No thread, and no tick: the loop wakes when something is due. The controller's time is that of the loop;
    so it jumps where the loop's does.
    """

    def __init__(self, url: str, make: Maker, loop: asyncio.AbstractEventLoop) -> None:
        self.url = url
        clock = RealClock(lambda: round(loop.time() * SECOND))
        self._line = _LoopLink(make(clock), loop)
        self._server = Server(clock)

    @classmethod
    async def open(cls, url: str, make: Maker) -> Self:
        """Make a controller, and a line to it."""
        link = cls(url, make, asyncio.get_running_loop())
        await link._server.open(link._line)
        return link

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Call back from now on; see :meth:`.AsyncLink.start`."""
        unplugged = f"{self.url}: the line to the controller was unplugged"
        self._line.start(received, lambda: lost(TransportLostError(unplugged)))

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which takes them at once and answers when this has returned."""
        if not self._line.connected:
            raise TransportLostError(
                f"{self.url}: the line to the controller is closed or unplugged"
            )
        self._line.take(data)

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.AsyncLink.write_now`."""
        with contextlib.suppress(TransportLostError):
            self.write(data)

    async def close(self) -> None:
        """Unplug the controller, which is no more."""
        self._line.leave()
        if self._line in self._server.links:
            await self._server.close()


class _LoopLink(ServedLink):
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

"""A line for asyncio on a port that no event loop can watch; the one kind that needs threads."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable

from stagewire.errors import TransportLost
from stagewire.links.link import FLUSH, AsyncLink
from stagewire.links.loss import CLOSED, because, lost
from stagewire.links.pump import Pump, write_all
from stagewire.links.serial_port import Port

__all__ = ["AsyncPumpedLink"]


class AsyncPumpedLink(AsyncLink):
    """A line on a port of pyserial; one thread reads it, and one writes, as both may wait.

    :param url: for people.
    :param port: open; reads without a time limit.
    """

    def __init__(self, url: str, port: Port) -> None:
        self.url = url
        self._port = port
        self._loop = asyncio.get_running_loop()
        self._why = ""
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLost], None] | None = None
        self._kept: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._writer = threading.Thread(target=self._write, name=f"writes {url}", daemon=True)
        self._pump = Pump(port, self._from_thread, self._lost_in_thread)
        self._writer.start()

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLost], None]
    ) -> None:
        """Call back from now on; see :meth:`.AsyncLink.start`."""
        self._received, self._lost = received, lost
        if self._why:
            self._loop.call_soon(self._say_lost)
        else:
            self._pump.start()

    def write(self, data: bytes) -> None:
        """Send bytes; see :meth:`.AsyncLink.write`."""
        if self._why:
            raise lost(self.url, self._why)
        self._kept.put(data)

    def write_now(self, data: bytes) -> None:
        """Send bytes behind what is kept, and wait a moment for it; see :meth:`.AsyncLink.write_now`."""
        if not self._why:
            self._kept.put(data)
            self._kept.put(None)
            self._writer.join(FLUSH)

    async def close(self) -> None:
        """Send what is kept, and give the port back; see :meth:`.AsyncLink.close`."""
        if self._why == CLOSED:
            return
        self._why, self._lost = CLOSED, None
        await asyncio.shield(self._loop.run_in_executor(None, self._end))

    def _end(self) -> None:
        self._kept.put(None)
        self._writer.join(FLUSH)
        self._pump.stop()
        self._writer.join(FLUSH)  # a write that waited has failed now

    # In the threads

    def _write(self) -> None:
        while (data := self._kept.get()) is not None:
            try:
                write_all(self._port, data)
            except Exception as error:  # what pyserial raises differs from port to port
                self._lost_in_thread(because(error))
                return

    def _from_thread(self, data: bytes) -> None:
        self._in_loop(self._take, data)

    def _lost_in_thread(self, why: str) -> None:
        self._in_loop(self._lose, why)

    def _in_loop(self, call: Callable[..., None], argument: object) -> None:
        with contextlib.suppress(
            RuntimeError
        ):  # the loop was closed, and nobody is there to hear it
            self._loop.call_soon_threadsafe(call, argument)

    # In the loop

    def _take(self, data: bytes) -> None:
        if self._received is not None and not self._why:
            self._received(data)

    def _lose(self, why: str) -> None:
        self._why = self._why or why
        self._say_lost()

    def _say_lost(self) -> None:
        if self._lost is not None:
            say, self._lost = self._lost, None
            say(lost(self.url, self._why))

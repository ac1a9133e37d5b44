"""A line for asyncio on a descriptor that an event loop can watch: a port of POSIX."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from stagewire.errors import TransportLost
from stagewire.links.descriptor import CHUNK
from stagewire.links.link import FLUSH, AsyncLink
from stagewire.links.loss import CLOSED, because, lost, stalled
from stagewire.links.readiness import has_input

__all__ = ["AsyncDescriptorLink"]


class AsyncDescriptorLink(AsyncLink):
    """A line on a descriptor that does not block; no thread, and nothing that looks again and again.

    :param url: for people.
    :param descriptor: what the loop watches.
    :param take: reads at most so many bytes; ``b""`` means that the other end is gone.
    :param give: writes what is taken at once, and returns how much.
    :param shut: gives the descriptor back; called once.
    :param gone: what ``b""`` means, in words.
    :param stall_timeout: seconds after which a line that takes nothing is gone.
    """

    def __init__(
        self,
        url: str,
        descriptor: int,
        take: Callable[[int], bytes],
        give: Callable[[bytes], int],
        shut: Callable[[], Awaitable[None]],
        gone: str,
        stall_timeout: float,
    ) -> None:
        self.url = url
        self._descriptor = descriptor
        self._take = take
        self._give = give
        self._shut = shut
        self._gone = gone
        self._stall_timeout = stall_timeout
        self._loop = asyncio.get_running_loop()
        self._kept = bytearray()  # what the system did not take yet
        self._empty: asyncio.Future[None] | None = None  # somebody waits until nothing is kept
        self._stall: asyncio.TimerHandle | None = None
        self._why = ""
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLost], None] | None = None

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLost], None]
    ) -> None:
        """Call back from now on; see :meth:`.AsyncLink.start`."""
        self._received, self._lost = received, lost
        if self._why:
            self._loop.call_soon(self._say_lost)
        else:
            self._loop.add_reader(self._descriptor, self._readable)

    def write(self, data: bytes) -> None:
        """Send bytes; see :meth:`.AsyncLink.write`."""
        if self._why:
            raise lost(self.url, self._why)
        if self._kept:
            self._kept += data
            return
        sent = self._write_some(data)
        if self._why:
            raise lost(self.url, self._why)
        if sent < len(data):
            self._kept += data[sent:]
            self._loop.add_writer(self._descriptor, self._writable)
            self._watch()

    def write_now(self, data: bytes) -> None:
        """Send what is taken at once; see :meth:`.AsyncLink.write_now`."""
        if not self._why and not self._kept:
            with contextlib.suppress(OSError):
                self._give(data)

    def has_unread(self) -> bool:
        """Say whether something came that was not passed on; see :meth:`.AsyncLink.has_unread`."""
        return not self._why and has_input(self._descriptor)

    async def close(self) -> None:
        """Send what is kept, and give the port back; see :meth:`.AsyncLink.close`."""
        if self._why == CLOSED:
            return
        self._lost = None
        try:
            if self._kept:
                self._empty = self._loop.create_future()
                await asyncio.wait((self._empty,), timeout=FLUSH)
        finally:
            self._end(CLOSED)
            await self._shut()

    # As the loop calls it

    def _readable(self) -> None:
        try:
            data = self._take(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(because(error))
            return
        if not data:
            self._end(self._gone)
        elif self._received is not None:
            self._received(data)

    def _writable(self) -> None:
        sent = self._write_some(bytes(self._kept))
        if not sent:
            return
        del self._kept[:sent]
        if self._kept:
            self._watch()
        else:
            self._wrote_all()

    def _write_some(self, data: bytes) -> int:
        try:
            return self._give(data)
        except BlockingIOError:
            return 0
        except OSError as error:
            self._end(because(error))
            return 0

    def _watch(self) -> None:
        """Give the line time anew: it took something."""
        if self._stall is not None:
            self._stall.cancel()
        self._stall = self._loop.call_later(
            self._stall_timeout, self._end, stalled(self._stall_timeout)
        )

    def _wrote_all(self) -> None:
        self._loop.remove_writer(self._descriptor)
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None
        if self._empty is not None and not self._empty.done():
            self._empty.set_result(None)

    def _end(self, why: str) -> None:
        """Use the descriptor no more, and say so, unless it was closed by this side."""
        if self._why and why != CLOSED:
            return
        if not self._why:
            self._loop.remove_reader(self._descriptor)
            self._kept.clear()
            self._wrote_all()
            self._loop.call_soon(self._say_lost)
        self._why = why

    def _say_lost(self) -> None:
        if self._lost is not None:
            say, self._lost = self._lost, None
            say(lost(self.url, self._why))

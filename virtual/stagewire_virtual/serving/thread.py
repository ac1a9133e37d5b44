"""The one thread in which controllers are served for a program that has no event loop of its own."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any, ClassVar, TypeVar

from stagewire_virtual.clock import Clock, RealClock, SteppedClock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.serving.link import Maker, ServedLink
from stagewire_virtual.serving.places import Place
from stagewire_virtual.serving.server import Server

__all__ = ["ServingThread"]

_T = TypeVar("_T")
_ROUNDS = 8  # of the event loop, from a connection that the system has made to its first bytes


class ServingThread:
    """A thread with an event loop, for all controllers that are served at a time.

    It begins with the first of them and ends with the last. One thread for all lets several share a clock.
    Use :meth:`enter` and :meth:`leave`, not the constructor.
    """

    _lock: ClassVar = threading.Lock()
    _current: ClassVar[ServingThread | None] = None

    def __init__(self) -> None:
        self._users = 0
        self._over = False
        self._servers: dict[Clock, Server] = {}
        self._errors: list[BaseException] = []
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(self._note_error)
        self._thread = threading.Thread(target=self._live, name="stagewire-virtual", daemon=True)
        self._thread.start()

    @classmethod
    def enter(cls) -> ServingThread:
        """Return the thread; :meth:`leave` is to be called once for each call."""
        with cls._lock:
            # A process that was forked has the object, but not the thread.
            if cls._current is None or not cls._current._thread.is_alive():
                cls._current = cls()
            cls._current._users += 1
            return cls._current

    def leave(self) -> None:
        """Need the thread no more; the last one to leave ends it."""
        with self._lock:
            self._users -= 1
            if self._users:
                return
            type(self)._current = None
        self._loop.call_soon_threadsafe(self._end)
        self._thread.join()
        self._loop.close()

    def _live(self) -> None:
        while not self._over:
            # These alone leave the event loop. Who called has them, too, as in any thread.
            with contextlib.suppress(SystemExit, KeyboardInterrupt):
                self._loop.run_forever()

    def _end(self) -> None:
        self._over = True
        self._loop.stop()

    def check(self) -> None:
        """Raise :class:`~stagewire_virtual.errors.VirtualError` where waiting for the thread has no end."""
        if threading.current_thread() is self._thread:
            raise VirtualError(
                "in the thread that serves (within call(), or in an observer) nothing can be served or "
                "closed; do it from the thread that called"
            )
        if not self._thread.is_alive():
            raise VirtualError(
                "the thread that serves is not in this process, which was forked from that one"
            )

    def serve(
        self, make: Maker, place: Place, clock: Clock | None = None, label: str = ""
    ) -> ServedLink:
        """Make a far end and serve it; on a real clock of its own if none is given.

        Raises what ``make`` raises, and :class:`~stagewire_virtual.errors.ServingError`.
        """
        clock = RealClock() if clock is None else clock
        return self._wait(lambda: self._serve(make, place, clock, label))

    def close(self, link: ServedLink) -> None:
        """Serve a link no more.

        Raises :class:`~stagewire_virtual.errors.VirtualError` when a controller failed meanwhile: nothing
        that a host sends should make it, so that this is an error in this package or in an observer.
        """
        self._wait(lambda: self._close(link))
        if self._errors:
            error = self._errors.pop(0)
            raise VirtualError(
                f"a virtual controller failed while it was served: {error!r}"
            ) from error

    def call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Run a function in the thread and return what it returns, or raise what it raises.

        What a host on this machine has sent by TCP before is taken first.
        """
        if threading.current_thread() is self._thread:
            return function(*arguments)
        return self._wait(lambda: self._call(function, *arguments))

    def _wait(self, job: Callable[[], Coroutine[Any, Any, _T]]) -> _T:
        self.check()
        return asyncio.run_coroutine_threadsafe(job(), self._loop).result()

    async def _call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        await _let_come()
        return function(*arguments)

    async def _serve(self, make: Maker, place: Place, clock: Clock, label: str) -> ServedLink:
        link = place.link(make(clock), label=label)
        server = self._servers.get(clock) or Server(clock)
        await server.open(link)
        self._servers[clock] = server
        if isinstance(clock, SteppedClock):
            clock.call = self.call
        return link

    async def _close(self, link: ServedLink) -> None:
        server = self._servers[link.clock]
        await server.close_link(link)
        if not server.links:
            await server.close()
            del self._servers[link.clock]
            if isinstance(link.clock, SteppedClock):
                link.clock.call = None
        await _let_come()  # who came just now, or was broken off, is told so

    def _note_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if error is not None and not isinstance(error, OSError):  # a host may be gone at any time
            self._errors.append(error)


async def _let_come() -> None:
    """Take what hosts on this machine have done by now."""
    for _ in range(_ROUNDS):
        await asyncio.sleep(0)

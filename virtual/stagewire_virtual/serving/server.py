"""Virtual controllers served to other programs, on an event loop or from a thread.

A :class:`Server` serves any number of them on one event loop, and is awake only when something is due or
comes. A :class:`ServingThread` is the one thread in which controllers are served for a program that has no
event loop of its own; users hold each of those as a :class:`ServedController`.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any, ClassVar, TypeVar

from stagewire.links import AsyncClosing, Closing
from stagewire_virtual.clock import SECOND, Clock, RealClock, SteppedClock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.serving.endpoints import Endpoint
from stagewire_virtual.serving.link import Maker, ServedLink, at_this_instant


class Server(AsyncClosing):
    """Serves links whose far ends share one clock, in the event loop that is running.

    On a :class:`~stagewire_virtual.clock.RealClock` it sleeps until the next timer is due. A
    :class:`~stagewire_virtual.clock.SteppedClock` stands still between the calls of its ``advance``, which
    are to be made in the thread of the event loop.

    :param clock: a new real one by default; no other server may have it at the same time.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = RealClock() if clock is None else clock
        self.links: list[ServedLink] = []
        self._alarm: asyncio.TimerHandle | None = None
        self._alarm_at: int | None = None
        self._running = False
        self.clock.on_earlier = self._set_alarm

    async def open(self, link: ServedLink) -> None:
        """Serve a link whose far end has the clock of this server.

        Raises :class:`~stagewire_virtual.errors.ServingError` where that cannot be.
        """
        await link.open(self.run)
        self.links.append(link)
        self._set_alarm()

    async def close_link(self, link: ServedLink) -> None:
        """Serve a link no more."""
        self.links.remove(link)
        await link.close()

    async def close(self) -> None:
        """Close all links, and wake no more."""
        for link in list(self.links):
            await self.close_link(link)
        self.clock.on_earlier = None
        self._cancel_alarm()

    def run(self, callback: Callable[[], None]) -> None:
        """Do something at this instant, after all that is due, and see what is due next."""
        self._running = True
        try:
            at_this_instant(self.clock, callback)
        finally:
            self._running = False
            self._set_alarm()

    def _set_alarm(self) -> None:
        """See to being woken when the next timer is due; nobody wakes a clock that is stepped."""
        if self._running or not isinstance(self.clock, RealClock):
            return
        due = self.clock.next_due
        if due == self._alarm_at:
            return
        self._cancel_alarm()
        if due is not None:
            delay = (due - self.clock.now) / SECOND
            self._alarm = asyncio.get_running_loop().call_later(delay, self._wake)
            self._alarm_at = due

    def _cancel_alarm(self) -> None:
        if self._alarm is not None:
            self._alarm.cancel()
        self._alarm = self._alarm_at = None

    def _wake(self) -> None:
        self._alarm = self._alarm_at = None
        self.run(_nothing)


def _nothing() -> None:
    """Do nothing but let time go on."""


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
        self, make: Maker, place: Endpoint, clock: Clock | None = None, label: str = ""
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
        await _yield_to_hosts()
        return function(*arguments)

    async def _serve(self, make: Maker, place: Endpoint, clock: Clock, label: str) -> ServedLink:
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
        await _yield_to_hosts()  # who came just now, or was broken off, is told so

    def _note_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if error is not None and not isinstance(error, OSError):  # a host may be gone at any time
            self._errors.append(error)


async def _yield_to_hosts() -> None:
    """Take what hosts on this machine have done by now."""
    for _ in range(_ROUNDS):
        await asyncio.sleep(0)


class ServedController(Closing):
    """A virtual controller that other programs, or a serial port in this one, reach by :attr:`url`.

    It lives in a thread, the same for all that are served, and in real time, unless it was made with a
    :class:`~stagewire_virtual.clock.SteppedClock`: then :meth:`advance` lets time go on. Whatever is done to
    it goes through :meth:`call`. Of controllers that share a clock either all are served or none.

    :param make: makes the controller, in that thread.
    :param place: where it is served.
    :param clock: a stepped one; None: real time.
    :param label: for people.
    """

    def __init__(
        self, make: Maker, place: Endpoint, clock: SteppedClock | None = None, label: str = ""
    ) -> None:
        self.label = label
        self._thread = ServingThread.enter()
        self._closed = False
        try:
            self.link: ServedLink = self._thread.serve(make, place, clock, label)
        except BaseException:
            self._closed = True
            self._thread.leave()
            raise

    def __repr__(self) -> str:
        return f"<ServedController {self.label}: {self.url}{' (closed)' if self._closed else ''}>"

    @property
    def url(self) -> str:
        """What pyserial's ``serial_for_url`` opens: ``socket://127.0.0.1:40123``, ``/dev/pts/7``."""
        return self.link.url

    @property
    def instrument(self) -> Instrument:
        """The controller itself; to be touched within :meth:`call` only."""
        return self.link.instrument

    def call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Run a function in the thread where the controller lives; return or raise what it does.

        What a host on this machine has sent by TCP before is taken first; over a pseudo-terminal bytes are on
        their way for a while, so that a test waits for an answer instead.
        """
        self._check_open()
        return self._thread.call(function, *arguments)

    def advance(self, seconds: float) -> None:
        """Let time go on, on a stepped clock; see :meth:`call` for what is taken before.

        Raises :class:`~stagewire_virtual.errors.VirtualError` on a real one.
        """
        clock = self.link.clock
        if not isinstance(clock, SteppedClock):
            raise VirtualError(
                "real time goes on by itself; give clock=SteppedClock() to let it go on step by step"
            )
        self.call(clock.advance, seconds)

    def power_cycle(self) -> None:
        """Switch it off and on; a connection stays."""
        self.call(at_this_instant, self.link.clock, self.instrument.power_cycle)

    def unplug(self) -> None:
        """Break the connection off; the host may come again. See the links for what that means to each."""
        self.call(self.link.disconnect)

    def close(self) -> None:
        """Serve it no more, and end the thread if it was the last one; harmless when done twice.

        Raises :class:`~stagewire_virtual.errors.VirtualError` when a controller failed in that thread, and,
        before anything is done, when it is called in it.
        """
        if self._closed:
            return
        self._thread.check()
        self._closed = True
        try:
            self._thread.close(self.link)
        finally:
            self._thread.leave()

    def _check_open(self) -> None:
        if self._closed:
            raise VirtualError(f"{self.label or 'the controller'} is not served any more")

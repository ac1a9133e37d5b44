"""Servers for virtual controllers, on an event loop or in a thread.

A :class:`Server` serves any number of controllers on one event loop; it wakes up only for timers and incoming
bytes. :class:`ServingThread` is the one thread that serves controllers for programs without an event loop.
Users get a :class:`ServedController` for each of them.
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
    """Serves links whose far ends share one clock, on the running event loop.

    With a :class:`~stagewire_virtual.clock.RealClock` it sleeps until the next timer. A
    :class:`~stagewire_virtual.clock.SteppedClock` runs only when its ``advance`` is called, which must happen
    in the thread of the event loop.

    :param clock: the clock, which no other server may use; a new real clock by default.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = RealClock() if clock is None else clock
        self.links: list[ServedLink] = []
        self._alarm: asyncio.TimerHandle | None = None
        self._alarm_at: int | None = None
        self._running = False
        self.clock.on_earlier = self._set_alarm

    async def open(self, link: ServedLink) -> None:
        """Serve a link whose far end uses the clock of this server.

        Raises :class:`~stagewire_virtual.errors.ServingError` if it cannot be served there.
        """
        await link.open(self.run)
        self.links.append(link)
        self._set_alarm()

    async def close_link(self, link: ServedLink) -> None:
        """Stop serving a link."""
        self.links.remove(link)
        await link.close()

    async def close(self) -> None:
        """Close all links and stop waking up."""
        for link in list(self.links):
            await self.close_link(link)
        self.clock.on_earlier = None
        self._cancel_alarm()

    def run(self, callback: Callable[[], None]) -> None:
        """Run ``callback`` at this instant, after all timers that are due, and set the next alarm."""
        self._running = True
        try:
            at_this_instant(self.clock, callback)
        finally:
            self._running = False
            self._set_alarm()

    def _set_alarm(self) -> None:
        """Schedule a wake-up for the next timer; a stepped clock needs none."""
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
    """Do nothing, so that only the timers that are due run."""


_T = TypeVar("_T")
_ROUNDS = 8  # iterations of the event loop between a connection in the system and its first bytes


class ServingThread:
    """A thread with an event loop that serves all controllers of a process.

    It starts with the first controller and ends with the last. Controllers can share a clock because they
    share this thread. Use :meth:`enter` and :meth:`leave`, not the constructor.
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
        """Return the thread; call :meth:`leave` once for each call of this method."""
        with cls._lock:
            # A forked process has a copy of the object, but not the thread.
            if cls._current is None or not cls._current._thread.is_alive():
                cls._current = cls()
            cls._current._users += 1
            return cls._current

    def leave(self) -> None:
        """Release the thread; the last call ends it."""
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
            # Only these two exceptions stop the event loop. The caller also gets them, from the future.
            with contextlib.suppress(SystemExit, KeyboardInterrupt):
                self._loop.run_forever()

    def _end(self) -> None:
        self._over = True
        self._loop.stop()

    def check(self) -> None:
        """Raise :class:`~stagewire_virtual.errors.VirtualError` if waiting for the thread would never end."""
        if threading.current_thread() is self._thread:
            raise VirtualError(
                "cannot serve or close a controller from the server thread (inside call() or an "
                "observer); do it from another thread"
            )
        if not self._thread.is_alive():
            raise VirtualError(
                "the server thread is not running in this process, which was forked after it started"
            )

    def serve(
        self, make: Maker, place: Endpoint, clock: Clock | None = None, label: str = ""
    ) -> ServedLink:
        """Make a far end and serve it, on a new real clock by default.

        Raises the errors of ``make``, and :class:`~stagewire_virtual.errors.ServingError`.
        """
        clock = RealClock() if clock is None else clock
        return self._wait(lambda: self._serve(make, place, clock, label))

    def close(self, link: ServedLink) -> None:
        """Stop serving a link.

        Raises :class:`~stagewire_virtual.errors.VirtualError` if a controller has failed since. No bytes of a
        host should cause that, so it indicates a bug in this package or in an observer.
        """
        self._wait(lambda: self._close(link))
        if self._errors:
            error = self._errors.pop(0)
            raise VirtualError(
                f"a virtual controller failed while being served: {error!r}"
            ) from error

    def call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Run a function in the thread and return its result or raise its error.

        Bytes that a host on this machine has sent by TCP are processed first.
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
        await _yield_to_hosts()  # close connections that were made or aborted just now

    def _note_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if error is not None and not isinstance(error, OSError):  # a host may be gone at any time
            self._errors.append(error)


async def _yield_to_hosts() -> None:
    """Process everything that hosts on this machine have sent by now."""
    for _ in range(_ROUNDS):
        await asyncio.sleep(0)


class ServedController(Closing):
    """A virtual controller that other programs, or a serial port in this one, open by :attr:`url`.

    All served controllers run in one thread; use :meth:`call` to access one. They run in real time, except
    with a :class:`~stagewire_virtual.clock.SteppedClock`, which :meth:`advance` advances. Controllers that
    share a clock must either all be served or all be in memory.

    :param make: makes the controller, in the server thread.
    :param place: the endpoint to serve it at.
    :param clock: a stepped clock; None: real time.
    :param label: a name for people.
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
        """The URL for pyserial's ``serial_for_url``: ``socket://127.0.0.1:40123``, ``/dev/pts/7``."""
        return self.link.url

    @property
    def instrument(self) -> Instrument:
        """The controller itself; use it only within :meth:`call`."""
        return self.link.instrument

    def call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Run a function in the server thread and return its result or raise its error.

        Bytes that a host on this machine has sent by TCP are processed first. On a pseudo-terminal bytes take
        some time to arrive: wait for an answer first.
        """
        self._check_open()
        return self._thread.call(function, *arguments)

    def advance(self, seconds: float) -> None:
        """Advance a stepped clock; bytes of hosts are processed first, as in :meth:`call`.

        Raises :class:`~stagewire_virtual.errors.VirtualError` on a real clock.
        """
        clock = self.link.clock
        if not isinstance(clock, SteppedClock):
            raise VirtualError(
                "cannot advance real time; create the controller with clock=SteppedClock() instead"
            )
        self.call(clock.advance, seconds)

    def power_cycle(self) -> None:
        """Switch the controller off and on; its connection stays open."""
        self.call(at_this_instant, self.link.clock, self.instrument.power_cycle)

    def unplug(self) -> None:
        """Break the connection; the host may connect again. See ``disconnect`` of each kind of link."""
        self.call(self.link.disconnect)

    def close(self) -> None:
        """Stop serving it, and end the thread after the last controller; safe to call twice.

        Raises :class:`~stagewire_virtual.errors.VirtualError` if a controller failed in the server thread, or
        if it is called in that thread, where it has no effect.
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
            raise VirtualError(f"{self.label or 'the controller'} is no longer served")

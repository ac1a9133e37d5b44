"""A line in memory with a simulated clock, whose far end is part of a test; for threads and asyncio.

A test is one coroutine for both sides. On the synchronous side it never suspends: calls return values, which
:func:`settled` passes through. On the asyncio side :func:`settled` awaits them.
"""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from importlib import import_module
from typing import Any, TypeVar

from stagewire.errors import ReplyTimeoutError, TransportLostError
from stagewire.links import AsyncLink, Link
from stagewire_apt import messages as m
from stagewire_virtual import stepped

T = TypeVar("T")
PACKAGE = "stagewire_apt"


async def settled(value: Any) -> Any:
    """Return a value, or the result of an awaitable."""
    return await value if inspect.isawaitable(value) else value


class FarEnd:
    """The other end of a line, which receives bytes and sends bytes with delays."""

    unplugged = False

    def take(self, data: bytes) -> Iterable[tuple[float, bytes | None]]:
        """Receive bytes of the host; return the answers, each with its delay in seconds.

        None instead of bytes pulls the plug.
        """
        raise NotImplementedError

    def say(self, data: bytes, delay: float = 0.0) -> None:
        """Send unsolicited bytes."""
        self.put(delay, data)

    def unplug(self) -> None:
        """Pull the plug immediately."""
        self.unplugged = True
        self.pulled()

    # Set by the line:
    put: Callable[[float, bytes | None], None]
    pulled: Callable[[], None]
    now: Callable[[], float]


class Waiting:
    """Bytes on their way to the host, in order of arrival."""

    def __init__(self) -> None:
        self._parts: list[tuple[float, int, bytes | None]] = []
        self._count = 0

    def put(self, time: float, data: bytes | None) -> None:
        self._count += 1
        self._parts.append((time, self._count, data))
        self._parts.sort(key=lambda part: part[:2])

    def first(self) -> float | None:
        return self._parts[0][0] if self._parts else None

    def due(self, now: float) -> tuple[bytes, bool]:
        """Return the bytes that have arrived, and whether the plug was pulled after them."""
        parts = [data for time, _, data in self._parts if time <= now]
        del self._parts[: len(parts)]
        pulled = None in parts
        if pulled:
            parts = parts[: parts.index(None)]
        return b"".join(part for part in parts if part is not None), pulled


class MemoryLink(Link):
    """The host's end of a line for a session without a background thread; reading advances its clock."""

    def __init__(self, far: FarEnd) -> None:
        self.url = "memory://"
        self.now = 0.0
        self.clock = lambda: self.now
        self._far = far
        self._waiting = Waiting()
        self._woken = self._closed = False
        far.put = lambda delay, data: self._waiting.put(self.now + delay, data)
        far.pulled = lambda: None
        far.now = self.clock

    def read(self, timeout: float) -> bytes:
        self._check()
        if self._woken:
            self._woken, timeout = False, 0.0
        until = self.now + (max(timeout, 1e-9) if timeout > 0 else 0.0)
        first = self._waiting.first()
        if first is None or first > until:
            self.now = until
            return b""
        self.now = max(self.now, first)
        data, pulled = self._waiting.due(self.now)
        self._far.unplugged = self._far.unplugged or pulled
        if not data:
            self._check()
        return data

    def write(self, data: bytes) -> None:
        self._check()
        for delay, said in self._far.take(data):
            self._waiting.put(self.now + delay, said)
        self._check()

    def write_now(self, data: bytes) -> None:
        with suppress(TransportLostError):
            self.write(data)

    def wake(self) -> None:
        self._woken = True

    def close(self) -> None:
        self._closed = True

    def _check(self) -> None:
        if self._closed or self._far.unplugged:
            raise TransportLostError(f"{self.url}: gone")


class AsyncMemoryLink(AsyncLink):
    """The same for an event loop."""

    def __init__(self, far: FarEnd) -> None:
        self.url = "memory://"
        self._far = far
        self._loop = asyncio.get_running_loop()
        self._timers: set[asyncio.TimerHandle] = set()
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLostError], None] | None = None
        far.put = self._put
        far.pulled = lambda: self._loop.call_soon(self._tell)
        far.now = self._loop.time

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        self._received, self._lost = received, lost

    def write(self, data: bytes) -> None:
        self._check()
        for delay, said in self._far.take(data):
            self._put(delay, said)
        self._check()

    def write_now(self, data: bytes) -> None:
        with suppress(TransportLostError):
            self.write(data)

    async def close(self) -> None:
        self._received = self._lost = None
        for timer in self._timers:
            timer.cancel()

    def _put(self, delay: float, data: bytes | None) -> None:
        def arrive() -> None:
            self._timers.discard(timer)
            if data is None:
                self._far.unplugged = True
                self._tell()
            elif self._received is not None and not self._far.unplugged:
                self._received(data)

        timer = self._loop.call_later(delay, arrive)
        self._timers.add(timer)

    def _tell(self) -> None:
        if (lost := self._lost) is not None:
            self._received = self._lost = None
            lost(TransportLostError(f"{self.url}: gone"))

    def _check(self) -> None:
        if self._far.unplugged:
            raise TransportLostError(f"{self.url}: gone")


class Bench:
    """The environment in which a test opens its device and lets time pass."""

    def __init__(self, far: FarEnd) -> None:
        self.far = far

    def open(self, unit: str, package: str = PACKAGE, **options: Any) -> Any:
        """``async with bench.open("TDC001", …) as device:``."""
        raise NotImplementedError

    async def sleep(self, seconds: float) -> None:
        """Let time pass, and read what arrives meanwhile."""
        raise NotImplementedError

    def now(self) -> float:
        raise NotImplementedError


class SyncBench(Bench):
    def __init__(self, far: FarEnd) -> None:
        super().__init__(far)
        self.link = MemoryLink(far)

    @asynccontextmanager
    async def open(self, unit: str, package: str = PACKAGE, **options: Any) -> AsyncIterator[Any]:
        cls = getattr(import_module(f"{package}.devices"), unit)
        with cls.open(self.link, **options) as device:
            self.device = device
            yield device

    async def sleep(self, seconds: float) -> None:
        # Waiting reads the line; wait for a message that no controller of these tests sends.
        with suppress(ReplyTimeoutError), self.device.subscribe(m.HwDisconnect) as nothing:
            nothing.get(seconds)

    def now(self) -> float:
        return self.link.now


class AsyncBench(Bench):
    def open(
        self, unit: str, package: str = PACKAGE, **options: Any
    ) -> AbstractAsyncContextManager[Any]:
        cls = getattr(import_module(f"{package}.aio"), unit)
        opening: AbstractAsyncContextManager[Any] = cls.open(AsyncMemoryLink(self.far), **options)
        return opening

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(seconds)

    def now(self) -> float:
        return asyncio.get_running_loop().time()


class Side:
    """One of the two ways to use a device."""

    def __init__(self, name: str, asynchronous: bool) -> None:
        self.name = name
        self.asynchronous = asynchronous

    def __repr__(self) -> str:
        return self.name

    def run(self, far: FarEnd, scenario: Callable[[Any], Coroutine[Any, Any, T]]) -> T:
        """Run a test with ``far`` at the other end of the line, in stepped time."""
        if self.asynchronous:

            async def main() -> T:
                return await scenario(AsyncBench(far))

            return stepped.run(main())
        return at_once(scenario(SyncBench(far)))


def at_once(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine that never suspends."""
    try:
        coroutine.send(None)
    except StopIteration as stop:
        value: T = stop.value
        return value
    coroutine.close()
    raise AssertionError("the synchronous side has suspended")


SIDES = [Side("sync", False), Side("asyncio", True)]

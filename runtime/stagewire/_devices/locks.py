"""Locks by key, for threads and for tasks; a call of several messages holds one until it is done."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

from stagewire.errors import ReplyTimeoutError


class Locks:
    """A lock for each key, which keeps out other threads."""

    def __init__(self) -> None:
        self._locks: dict[object, threading.Lock] = {}

    @contextmanager
    def lock(self, key: object, what: str, seconds: float | None) -> Iterator[None]:
        """Hold the lock of a key within a block.

        :param what: name of the call, for messages.
        :param seconds: timeout for acquiring it; None: no timeout.

        Raise :class:`~stagewire.errors.ReplyTimeoutError` if another thread holds it longer.
        """
        lock = self._locks.get(key) or self._locks.setdefault(key, threading.Lock())
        if not lock.acquire(timeout=-1 if seconds is None else min(seconds, threading.TIMEOUT_MAX)):
            raise _held(what, seconds)
        try:
            yield
        finally:
            lock.release()


class AsyncLocks:
    """A lock for each key, which keeps out other tasks."""

    def __init__(self) -> None:
        self._locks: dict[object, asyncio.Lock] = {}

    @asynccontextmanager
    async def lock(self, key: object, what: str, seconds: float | None) -> AsyncIterator[None]:
        """Hold the lock of a key within a block; see :meth:`Locks.lock`."""
        lock = self._locks.setdefault(key, asyncio.Lock())
        if not lock.locked():
            await lock.acquire()
        else:
            try:
                async with asyncio.timeout(seconds):
                    await lock.acquire()
            except TimeoutError:
                raise _held(what, seconds) from None
        try:
            yield
        finally:
            lock.release()


def _held(what: str, seconds: float | None) -> ReplyTimeoutError:
    return ReplyTimeoutError(
        f"{what} was not sent: another call of it did not finish within {seconds:.3g} s"
    )

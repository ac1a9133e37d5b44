"""Work in the background: a thread for devices of threads, a task for those of asyncio."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any


class Worker:
    """One function in a thread of its own, which other threads wake."""

    def __init__(self) -> None:
        self._woken = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, run: Callable[[], object], name: str) -> None:
        """Call ``run`` in a thread, which does not keep the process alive."""
        self._thread = threading.Thread(target=run, name=name, daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """End the present :meth:`wait`, or else the next."""
        self._woken.set()

    def wait(self, seconds: float) -> None:
        """Wait for :meth:`wake`, or for a time of the machine's clock."""
        self._woken.wait(seconds)
        self._woken.clear()

    def call(self, function: Callable[[], object]) -> None:
        """Call a function that may block, such as one that writes to a file."""
        function()

    def join(self, seconds: float) -> bool:
        """Wait for the end of the function; return whether it has ended."""
        if self._thread is not None:
            self._thread.join(seconds)
        return self._thread is None or not self._thread.is_alive()


class AsyncWorker:
    """One coroutine in a task of its own, which callbacks and other tasks of its loop wake."""

    def __init__(self) -> None:
        self._woken = asyncio.Event()
        self._task: asyncio.Task[Any] | None = None

    def start(self, run: Callable[[], Coroutine[Any, Any, Any]], name: str) -> None:
        """Run a coroutine in a task."""
        self._task = asyncio.create_task(run(), name=name)

    def wake(self) -> None:
        """End the present :meth:`wait`, or else the next."""
        self._woken.set()

    async def wait(self, seconds: float) -> None:
        """Wait for :meth:`wake`, or for a time."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._woken.wait()
        self._woken.clear()

    async def call(self, function: Callable[[], object]) -> None:
        """Call a function that may block, in a thread, so that the loop continues."""
        await asyncio.to_thread(function)

    async def join(self, seconds: float) -> bool:
        """Wait for the end of the coroutine; return whether it has ended."""
        if self._task is not None:
            await asyncio.wait({self._task}, timeout=seconds)
        return self._task is None or self._task.done()

"""Interruptions of calls at chosen moments: cancellation of the task, or Ctrl-C."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from typing import Any

from proof_line import MemoryLink


class CancelledAt:
    """An awaitable that cancels its own task when it suspends for the n-th time."""

    def __init__(self, awaitable: Any, number: int) -> None:
        self._awaitable = awaitable
        self._number = number
        self.suspended = 0

    def __await__(self) -> Generator[Any, Any, Any]:
        steps = self._awaitable.__await__()
        error: BaseException | None = None
        while True:
            try:
                future = next(steps) if error is None else steps.throw(error)
            except StopIteration as stop:
                return stop.value
            self.suspended += 1
            if self.suspended == self._number:
                task = asyncio.current_task()
                assert task is not None
                task.cancel()
            error = None
            try:
                yield future
            except BaseException as thrown:
                error = thrown


async def cancelled_at(awaitable: Any, number: int) -> bool:
    """Cancel at the n-th await; return whether the call reached it."""
    call = CancelledAt(awaitable, number)

    async def awaited() -> Any:
        return await call

    task = asyncio.ensure_future(awaited())
    [result] = await asyncio.gather(task, return_exceptions=True)
    reached = call.suspended >= number
    assert isinstance(result, asyncio.CancelledError) is reached, result
    return reached


class InterruptedLink(MemoryLink):
    """A link that raises KeyboardInterrupt in the n-th read from now."""

    left = 0

    def read(self, timeout: float) -> bytes:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
        return super().read(timeout)
